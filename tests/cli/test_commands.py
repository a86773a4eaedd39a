import json
import math
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from marking import long

import hsv as library
from hsv.base.units import PAPER_UNITS
from hsv.cli.entry import COMMANDS, MOVED, TREE
from hsv.cli.main import EXIT_CODES
from hsv.cli.output import unit_key
from hsv.control.design import find_design
from hsv.flight.metrics import METRICS
from hsv.flight.scenario import scenario_text

REFERENCE = Path(__file__).parents[2] / "bags" / "reference" / "case1"

PRINT_NO_NUMBERS = {"include", "play", "fault", "montecarlo"}
VISIBLE = [name for name, command in COMMANDS.items() if command.panel]
PUBLISHED_POINT = ("--altitude", "85000 ft", "--velocity", "7702.0808 ft/s")


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_help_of_every_command_has_an_example_and_json_if_it_prints_numbers(hsv, command):
    ran = hsv(command, "--help")
    assert ran.code == 0
    assert f"Example: hsv {command}" in ran.out
    assert command in PRINT_NO_NUMBERS or "--json" in ran.out


def test_the_version_is_that_of_the_library(hsv):
    assert hsv("--version").out == f"hsv {library.__version__}\n"


def test_help_and_documentation_have_the_same_exit_codes(hsv):
    page = (Path(__file__).parents[2] / "docs" / "exit_codes.md").read_text(encoding="utf-8")
    table = page.split("\n\n")[1].splitlines()[2:]
    assert table == [f"| {code} | {meaning} |" for code, meaning in EXIT_CODES.items()]
    said = " ".join(hsv("--help").out.split())
    assert all(f"{code} {meaning}" in said for code, meaning in EXIT_CODES.items())


@pytest.mark.parametrize(
    ("typed", "due"),
    [long("hsv re", {"report", "replay", "recover", "resilience"}), long("hsv trim --un", {"--units"})],
)
def test_a_shell_is_told_the_words_that_may_come(tmp_path, typed, due):
    asked = {"_HSV_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(typed.count(" "))}
    ran = subprocess.run(
        [sys.executable, "-m", "hsv.cli.entry"], capture_output=True, text=True, cwd=tmp_path, env=os.environ | asked
    )
    assert ran.returncode == 0 and set(ran.stdout.split()) == due


def test_the_list_of_commands_is_the_answer_to_no_command(hsv):
    ran = hsv()
    assert ran.out == hsv("--help").out
    assert len(VISIBLE) <= 29
    listed = re.findall(r"^│ ([a-z]\S+) {2,}", ran.out, re.MULTILINE)
    assert sorted(listed) == sorted(VISIBLE)
    assert all(f"─ {panel} ─" in ran.out for panel, _, _ in TREE if panel)


@pytest.mark.parametrize("old", MOVED)
def test_an_old_name_is_answered_in_one_line_with_the_new_one(hsv, old):
    ran = hsv(old, "case1", "--json")
    assert ran.code == 2 and ran.out == ""
    assert ran.error == f"hsv {old} {MOVED[old]}"
    assert {*re.findall(r"hsv (\S+)", MOVED[old])} <= {*COMMANDS}


def test_trim_of_the_literature_to_all_digits(hsv):
    values = hsv("trim", *PUBLISHED_POINT, "--units", "paper", "--json").json
    assert round(values["angle_of_attack_deg"], 4) == 1.6446
    assert round(values["fuel_equivalence_ratio"], 5) == 0.26809
    assert round(values["elevator_deflection_deg"], 3) == 12.540
    assert round(values["elastic_coordinate_1_sqrt_slug_ft"], 4) == 0.9739
    assert round(values["elastic_coordinate_2_sqrt_slug_ft"], 4) == 0.7999
    assert values["altitude_ft"] == pytest.approx(85000)
    assert values["largest_residual_si"] < 1e-12


@pytest.mark.parametrize(
    ("coupling", "expected"),
    [("derived", {(13.73, 0.0166), (18.80, 0.0197)}), ("paper_like", {(15.89, 0.0198), (19.47, 0.0199)})],
)
def test_linearise_prints_the_coupled_poles(hsv, coupling, expected):
    values = hsv("linearise", "--coupling", coupling, "--json").json
    poles = {(round(p["natural_frequency_rad_per_s"], 2), round(p["damping_ratio"] or 0.0, 4)) for p in values["poles"]}
    assert expected <= poles
    assert np.array(values["A_si"]).shape == (9, 9)
    assert np.array(values["B_si"]).shape == (9, 2)
    table = hsv("linearise", "--coupling", coupling).out
    assert all(f"{frequency:.3g}" in table for frequency, _ in expected)
    assert "…" not in table
    origin = values["poles"][-1]
    assert abs(origin["natural_frequency_rad_per_s"]) < 1e-9 and origin["damping_ratio"] is None
    assert table.rstrip().splitlines()[-1].split() == ["0", "0", "0", "-"]


def test_linearise_in_paper_units_has_the_same_poles(hsv):
    si, paper = hsv("linearise", "--json").json, hsv("linearise", "--units", "paper", "--json").json
    eigenvalues = [np.sort_complex(np.linalg.eigvals(np.array(m))) for m in (si["A_si"], paper["A_paper"])]
    np.testing.assert_allclose(*eigenvalues, atol=1e-6)
    # ft/s of climb per degree of pitch angle: V pi / 180.
    assert paper["A_paper"][0][3] == pytest.approx(7702.0808 * math.pi / 180, rel=1e-6)
    # Fuel has no unit: ft/s^2 of acceleration per unit.
    assert paper["B_paper"][1][0] == pytest.approx(si["B_si"][1][0] / 0.3048, rel=1e-9)


def test_a_linear_model_in_json_describes_itself(hsv, tmp_path):
    values = hsv("linearise", "--model", "ECM", "--units", "paper", "--out", "model.json", "--json").json
    assert json.loads((tmp_path / "model.json").read_text()) == values
    assert values["states"][4] == "filtered_pitch_rate" and values["state_units"][:2] == ["ft", "ft/s"]
    assert np.array(values["C_paper"]).shape == (11, 11) and np.array(values["D_paper"]).shape == (11, 2)
    assert values["operating_point"]["velocity_ft_per_s"] == pytest.approx(7702.0808)
    assert (values["vehicle"], values["coupling"], values["model"]) == ("parker", "paper_like", "ECM")
    assert values["outputs"] == values["states"] and values["input_units"] == ["1", "deg"]


@pytest.mark.parametrize("units", ["si", "paper"])
def test_simulate_case1(hsv, units):
    ran = hsv("simulate", "case1", "--units", units, "--json")
    assert ran.code == 0
    assert ran.json["scenario"] == "case1"
    assert ran.json["within_limits"] is True
    assert ran.json["diverged_at_s"] is None
    assert ran.json["real_time_factor"] > 0
    for key in ran.json["metrics"]:
        name = next(name for name in sorted(METRICS, key=len, reverse=True) if key.startswith(name))
        si = METRICS[name].unit
        unit = unit_key(PAPER_UNITS.get(si, si) if units == "paper" else si)
        assert key == "_".join(filter(None, (name, unit)))
    assert ("altitude_end_error_ft" in ran.json["metrics"]) is (units == "paper")


def test_simulate_saves_the_histories(hsv, tmp_path):
    assert hsv("simulate", "case1", "--out", "flight.npz", "--json").code == 0
    saved = np.load(tmp_path / "flight.npz")
    assert saved["time"].shape == (10001,)
    assert saved["state"].shape == (10001, 9)
    assert saved["state"][0, 0] == 26060.4
    assert [path.name for path in tmp_path.iterdir()] == ["flight.npz"]


def test_a_flight_that_diverges_is_reported_and_is_no_success(hsv):
    ran = hsv("simulate", "case1_derived_no_notch", "--json")
    assert ran.code == 1
    assert ran.json["within_limits"] is False
    assert ran.json["diverged_at_s"] == pytest.approx(17.6, abs=0.4)
    assert ran.error.startswith("flight diverged at t = 17.")
    table = hsv("simulate", "case1_derived_no_notch").out
    assert "not flown" in table and "over 0" in table and "within" not in table


def test_json_has_no_numbers_that_json_lacks(hsv, tmp_path, capsys):
    from hsv.cli.output import print_json

    print_json({"a": math.nan, "b": [1.0, math.inf], "c": {"d": -math.inf}, "e": 1})
    values = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert values == {"a": None, "b": [1.0, None], "c": {"d": None}, "e": 1}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("trim", "--altitude", "85000"),
            "altitude = '85000': the unit is missing, expected a finite quantity such as '85500 ft'",
        ),
        (("trim", "--altitude", "85000 s"), "altitude = '85000 s': wrong unit"),
        (("trim", "--velocity", "nan ft/s"), "velocity = 'nan ft/s': "),
        (
            ("trim", "--altitude", "200000 ft"),
            "altitude = '200000 ft', velocity = '7702.0808 ft/s': trim needs fuel_equivalence_ratio = -",
        ),
        (("trim", "--climb-rate", "10"), "climb_rate = '10': the unit is missing"),
        (("trim", "--acceleration", "4 ft/s"), "acceleration = '4 ft/s': wrong unit"),
        (
            ("trim", "--climb-rate", "10 km/s"),
            "altitude = '85000 ft', velocity = '7702.0808 ft/s', climb_rate = '10 km/s': expected a climb rate below",
        ),
        (
            ("trim", "--acceleration", "100 ft/s^2"),
            "altitude = '85000 ft', velocity = '7702.0808 ft/s', acceleration = '100 ft/s^2': trim needs fuel",
        ),
        (("trim", "--coupling", "strong"), "coupling = 'strong': expected one of paper_like, derived"),
        (
            ("trim", "--vehicle", "parkr"),
            "vehicle 'parkr': expected one of parker, winged_cone or the path of a TOML file",
        ),
        (
            ("linearise", "--vehicle", "absent.toml"),
            "vehicle 'absent.toml': cannot be read (No such file or directory)",
        ),
        (
            ("list", "vehicles", "absent"),
            "vehicle 'absent': expected one of parker, winged_cone or the path of a TOML",
        ),
        (("linearise", "--model", "ecm"), "model = 'ecm': expected one of CM, DM, ECM (did you mean 'ECM'?)"),
        (
            ("linearise", "--model", "ECM", "--reading", "print"),
            "reading = 'print': expected one of physical, printed (d",
        ),
        (("linearise", "--out", "model.txt"), "out = 'model.txt': expected a file that ends in .mat, .npz or .json"),
        (("simulate", "case9"), "scenario 'case9': expected a path or one of case1, case1_active"),
        (("simulate", "case1", "--units", "feet"), "Invalid value for '--units': 'feet' is not one of 'metric', 'si'"),
        (("simulate", "absent.toml"), "scenario 'absent.toml': cannot be read (No such file or directory)"),
        (("simulate", "case1", "--out", "absent/x.npz"), "out = 'absent/x.npz': cannot be written, expected a file"),
        (("design", "absent"), "design = 'absent': no such file, expected the path of a .toml file"),
        (("design", "baseline", "--out", "absent/x.yaml"), "out = 'absent/x.yaml': cannot be written, expected a file"),
        (("run", "case9"), "scenario 'case9': expected a path or one of case1"),
        (("info", "absent"), "absent: does not exist, expected a bag directory"),
    ],
)
def test_bad_input_is_one_line_with_code_2_and_nothing_written(hsv, tmp_path, words, message):
    ran = hsv(*words)
    assert ran.code == 2
    assert ran.out == ""
    assert ran.error.startswith(message)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        (("list", "scenario"), "scenarios"),
        (("list", "Faults"), "faults"),
        (("trim", "--units", "metrc"), "metric"),
        (("montecarlo", "case1", "--sampling", "sobl"), "sobol"),
        (("export", ".", "--format", "mta"), "mat"),
        (("linearise", "--model", "ecm"), "ECM"),
        (("bench", "--only", "graf"), "graph"),
        (("replay", str(REFERENCE), "--node", "tube"), "tube_mpc"),
        (("simulate", "case1_no_notsh"), "case1_no_notch"),
        (("design", "baselin"), "baseline"),
        (("verify", "baselin"), "baseline"),
        (("resilience", "--faults", "elevator_los"), "elevator_loss"),
        (("certify", "baseline", "--sensors", "fin"), "fine"),
    ],
)
def test_a_word_that_is_nearly_right_is_answered_with_the_right_one(hsv, words, hint):
    ran = hsv(*words)
    assert (ran.code, ran.out) == (2, "")
    assert f"(did you mean '{hint}'?)" in ran.error


@pytest.mark.parametrize("command", ["simulate", "run"])
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[vehicle]", "[vehicle]\nwings = 2", "vehicle.wings: unknown key"),
        ('"600 ft"', '"600 s"', "command[0].altitude_change = '600 s': wrong unit"),
        ('"85500 ft"', '"865000 ft"', "initial.altitude = '865000 ft': expected 85000 ft to 86500 ft"),
        ('"baseline"', '"absent"', "design = 'absent': no such file"),
        ('"baseline"', '"nan.yaml"', "parameter feedback.gain[0] = nan: expected double array"),
        ('"baseline"', '"short.yaml"', "parameter feedback.gain: 17 values, expected 18"),
        ('"baseline"', '"integer.yaml"', "parameter period = 1: expected double from 0.0001 to 1 s"),
        ('"baseline"', '"unstable.yaml"', "parameter feedback.gain: spectral radius"),
    ],
)
def test_a_bad_scenario_or_design_is_refused_before_anything_is_written(hsv, tmp_path, command, old, new, message):
    gain = read_gain()
    designs = {
        "nan.yaml": design_with(gain, [".nan", *gain[1:]]),
        "short.yaml": design_with(gain, gain[1:]),
        "unstable.yaml": design_with(gain, ["-" + word if word[0] != "-" else word[1:] for word in gain]),
        "integer.yaml": find_design("baseline").read_text().replace("period: 0.02", "period: 1"),
    }
    for name, text in designs.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "mine.toml").write_text(scenario_text("case1").replace(old, new))
    before = sorted(tmp_path.iterdir())
    ran = hsv(command, "mine.toml")
    assert ran.code == 2
    assert ran.out == ""
    assert message in ran.error
    assert sorted(tmp_path.iterdir()) == before


def gain_text():
    text = find_design("baseline").read_text()
    start = text.index("gain: [", text.index("feedback:")) + len("gain: [")
    return text, start, text.index("]", start)


def read_gain():
    text, start, end = gain_text()
    return [word.strip() for word in text[start:end].split(",")]


def design_with(gain, words):
    text, start, end = gain_text()
    assert len(gain) == 18
    return text[:start] + ", ".join(words) + text[end:]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("trim --units imperial", "Invalid value for '--units': 'imperial' is not one of"),
        ("trim --wings", "No such option: --wings"),
        ("simulat case1", "command 'simulat': unknown (did you mean 'simulate'?)"),
        ("simulate a b", "Got unexpected extra argument"),
        ("simulate case1 --json --json", "--json: given twice, expected once"),
        ("resilience --list --controllers ''", "--controllers = '': expected a text that is not empty"),
        ("resilience --list --faults ''", "--faults = '': expected a text that is not empty"),
        ("certify baseline --actuators ''", "--actuators = '': expected a text that is not empty"),
        ("replay nowhere --node ''", "--node = '': expected a text that is not empty"),
        ("simulate -- --traceback", "scenario '--traceback': expected a path or one of"),
        (
            "fault inject elevator_deflection bias '1 deg' --duration '1e300 s'",
            "duration = '1e300 s': expected from 0 to",
        ),
        ("trim --altitude 1 --units si --altitude 2", "--altitude: given twice, expected once"),
        ("montecarlo case1 --samples 3 --samples 4", "--samples: given twice, expected once"),
        ("simulate case1 --out x.csv", "out = 'x.csv': expected a file that ends in .npz"),
    ],
)
def test_usage_errors_are_one_line_with_code_2(hsv, words, message):
    ran = hsv(*shlex.split(words))
    assert ran.code == 2 and ran.out == ""
    assert ran.error.startswith(message)


@pytest.mark.parametrize("words", ["--traceback simulate absent.toml", "simulate absent.toml --traceback"])
def test_a_traceback_is_printed_if_asked_for(hsv, monkeypatch, words):
    monkeypatch.setenv("HSV_TRACEBACK", "0")
    assert hsv("simulate", "absent.toml").err.count("\n") == 1
    ran = hsv(*words.split())
    assert ran.code == 2
    assert ran.err.startswith("Traceback") and ran.err.splitlines()[-1].startswith("hsv: error: scenario 'absent.toml'")


def test_with_strict_a_limit_that_is_not_kept_is_no_success(hsv):
    assert hsv("simulate", "case1", "--strict").code == 0
    ran = hsv("simulate", "case1_single_k", "--units", "paper")
    assert ran.code == 0 and "over 2 ft/s" in ran.out and "within 0.25 deg" in ran.out
    ran = hsv("simulate", "case1_single_k", "--strict", "--all")
    assert ran.code == 1
    assert "limits not kept" in ran.error
    assert "not judged" in ran.out and "not judged" not in hsv("simulate", "case1").out


def command(*words, cwd):
    return subprocess.run([sys.executable, "-m", "hsv.cli.entry", *words], capture_output=True, text=True, cwd=cwd)


def test_as_a_process_it_fails_on_one_line(tmp_path):
    ran = command("simulate", "absent.toml", cwd=tmp_path)
    assert ran.returncode == 2
    assert ran.stdout == ""
    assert ran.stderr.count("\n") == 1
    assert ran.stderr.startswith("hsv: error: scenario 'absent.toml'")
    assert list(tmp_path.iterdir()) == []

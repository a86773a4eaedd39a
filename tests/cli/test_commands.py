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

from hsv.base.units import PAPER_UNITS
from hsv.cli.entry import COMMANDS, TREE
from hsv.cli.main import EXIT_CODES
from hsv.cli.output import print_json, unit_key
from hsv.control.design_file import find_design
from hsv.flight.metrics import METRICS
from hsv.flight.scenario import scenario_text
from hsv.model.vehicle import load_vehicle

REFERENCE = Path(__file__).parents[2] / "bags" / "reference" / "case1"

PRINT_NO_NUMBERS = {"include", "play", "fault", "montecarlo"}
VISIBLE = [name for name, command in COMMANDS.items() if command.panel]


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_help_of_every_command_has_an_example_and_json_if_it_prints_numbers(hsv, command):
    ran = hsv(command, "--help")
    assert ran.code == 0
    assert f"Example: hsv {command}" in ran.out
    assert command in PRINT_NO_NUMBERS or "--json" in ran.out


@pytest.mark.parametrize("command", sorted({*COMMANDS, "montecarlo fly", "fault inject"} - {"montecarlo", "fault"}))
def test_help_takes_at_most_two_lines_an_option_at_80_columns(hsv, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "80")
    lines = hsv(*command.split(), "--help").out.partition("\nOptions:\n")[2].splitlines()
    options = [number for number, line in enumerate(lines) if re.match("  -", line)]
    assert options and max(np.diff([*options, len(lines)])) <= 2
    assert not any("<bool>" in line for line in lines)


def test_help_and_documentation_have_the_same_exit_codes(hsv):
    page = (Path(__file__).parents[2] / "docs" / "exit_codes.md").read_text(encoding="utf-8")
    table = page.split("\n\n")[1].splitlines()[2:]
    assert table == [f"| {code} | {meaning} |" for code, meaning in EXIT_CODES.items()]
    said = " ".join(hsv("--help").out.split())
    assert all(f"{code} {meaning}" in said for code, meaning in EXIT_CODES.items())


def test_the_list_of_commands_is_the_answer_to_no_command(hsv):
    ran = hsv()
    assert ran.out == hsv("--help").out
    assert len(VISIBLE) <= 33
    listed = re.findall(r"^  ([a-z]\S+) {2,}", ran.out, re.MULTILINE)
    assert sorted(listed) == sorted(VISIBLE)
    assert all(f"\n{panel}:\n" in ran.out for panel, _, _ in TREE if panel)


@pytest.mark.parametrize("group", ["fault", "montecarlo"])
def test_a_group_without_a_command_prints_its_help(hsv, group):
    ran = hsv(group)
    assert ran.code == 2 and not ran.err
    assert ran.out == hsv(group, "--help").out


def test_trim_and_linearise_of_another_vehicle_are_inside_its_envelope(hsv):
    envelope = load_vehicle("winged_cone")
    words = ("--vehicle", "winged_cone", "--json")
    for found in (hsv("trim", *words).json, hsv("linearise", *words).json["operating_point"]):
        assert (found["altitude_m"], found["velocity_m_per_s"]) == pytest.approx(envelope.centre)


def test_the_damping_of_a_pole_at_the_origin_is_a_dash(hsv):
    origin = hsv("linearise", "--json").json["poles"][-1]
    assert abs(origin["natural_frequency_rad_per_s"]) < 1e-9 and origin["damping_ratio"] is None
    assert ["0", "0", "0", "-"] in [line.split() for line in hsv("linearise").out.splitlines()]


def test_linearise_in_paper_units_has_the_same_poles(hsv):
    si, paper = hsv("linearise", "--json").json, hsv("linearise", "--units", "paper", "--json").json
    eigenvalues = [np.sort_complex(np.linalg.eigvals(np.array(m))) for m in (si["A_si"], paper["A_paper"])]
    np.testing.assert_allclose(*eigenvalues, atol=1e-6)
    # Rate of climb in ft/s per degree of pitch angle: V pi / 180.
    assert paper["A_paper"][0][3] == pytest.approx(7702.0808 * math.pi / 180, rel=1e-6)
    # Fuel has no unit, so this is acceleration in ft/s^2 per unit.
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
    assert "not flown" in table and "over 0" in table and "verdict within" not in table


def test_json_has_no_numbers_that_json_lacks(capsys):
    print_json({"a": math.nan, "b": [1.0, math.inf], "c": {"d": -math.inf}, "e": 1})
    values = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert values == {"a": None, "b": [1.0, None], "c": {"d": None}, "e": 1}


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
        ('"85500 ft"', '"865000 ft"', "initial.altitude = '865000 ft': expected 85000 ft to 86500 ft"),
        ('"200 s"', '"200.01 s"', "duration = 200.01 s: expected a whole number of periods, 0.02 s each"),
        ('"baseline"', '"absent"', "design = 'absent': no such file"),
        ('"baseline"', '"wrong.yaml"', "wrong.yaml: parameter period = 1: expected double from 0.0001 to 1 s"),
    ],
)
def test_a_bad_scenario_or_design_is_refused_before_anything_is_written(hsv, tmp_path, command, old, new, message):
    (tmp_path / "wrong.yaml").write_text(find_design("baseline").read_text().replace("period: 0.02", "period: 1"))
    (tmp_path / "mine.toml").write_text(scenario_text("case1").replace(old, new))
    ran = hsv(command, "mine.toml")
    assert (ran.code, ran.out) == (2, "") and message in ran.error
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {"wrong.yaml", "mine.toml"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("trim --altitude 85000", "altitude = '85000': the unit is missing, expected a finite quantity such"),
        ("trim --acceleration '4 ft/s'", "acceleration = '4 ft/s': wrong unit"),
        ("trim --velocity 'nan ft/s'", "velocity = 'nan ft/s': "),
        (
            "trim --climb-rate '10 km/s'",
            "altitude = '85000 ft', velocity = '7702.0808 ft/s', climb_rate = '10 km/s': ex",
        ),
        ("trim --coupling strong", "coupling = 'strong': expected one of paper_like, derived"),
        ("trim --vehicle parkr", "vehicle 'parkr': expected one of parker, "),
        ("linearise --vehicle absent.toml", "vehicle 'absent.toml': cannot be read (No such file or directory)"),
        ("linearise --model ECM --reading print", "reading = 'print': expected one of physical, printed"),
        ("linearise --out model.txt", "out = 'model.txt': expected a file that ends in .mat, .npz or .json"),
        ("simulate absent.toml", "scenario 'absent.toml': cannot be read (No such file or directory)"),
        ("simulate case1 --out absent/x.npz", "out = 'absent/x.npz': cannot be written, expected a file"),
        ("design absent", "design = 'absent': no such file, expected the path of a .toml file"),
        ("design baseline --out absent/x.yaml", "out = 'absent/x.yaml': cannot be written, expected a file"),
        ("run case9", "scenario 'case9': expected a path or one of case1"),
        ("info absent", "absent: does not exist, expected a bag directory"),
        ("verify nope.yaml", "design = 'nope.yaml': no such file, expected the path of a .yaml file, a name in "),
        # Wrong words and options.
        ("trim --units imperial", "units = 'imperial': expected one of metric, si, paper"),
        ("montecarlo case1 --samples many", "samples = 'many': expected a valid integer"),
        ("topic /hsv/state --every 0", "every = '0': expected a number greater than or equal to 1"),
        ("trim --wings", "No such option: --wings"),
        ("simulat case1", "command 'simulat': unknown (did you mean 'simulate'?)"),
        ("list", "kind: missing, expected one of scenarios, vehicles, faults, equipment, controllers"),
        ("simulate a b", "Got unexpected extra argument"),
        ("simulate case1 --json --json", "--json: given twice, expected once"),
        ("resilience --list --controllers ''", "--controllers = '': expected a text that is not empty"),
        ("resilience --list --faults ''", "--faults = '': expected a text that is not empty"),
        ("certify baseline --actuators ''", "--actuators = '': expected a text that is not empty"),
        ("replay nowhere --node ''", "--node = '': expected a text that is not empty"),
        ("simulate -- --traceback", "scenario '--traceback': expected a path or one of"),
        ("fault inject engine thrust_loss '90 %' --duration '1e300 s'", "duration = '1e300 s': expected from 0 to"),
        ("trim --altitude 1 --units si --altitude 2", "--altitude: given twice, expected once"),
        ("montecarlo case1 --samples 3 --samples 4", "--samples: given twice, expected once"),
        ("simulate case1 --out x.csv", "out = 'x.csv': expected a file that ends in .npz"),
        # Options without effect.
        ("run case1 --live-port 9000", "live-port = 9000: expected with --live"),
        ("linearise --reading printed", "reading = 'printed': expected with model ECM"),
        ("montecarlo fly case1 --corners --samples 4", "samples = 4: expected no --samples with"),
        ("montecarlo case1 --scheduler tcp://127.0.0.1:9 --workers 2", "workers = 2: expected no"),
        ("montecarlo replay a.parquet --flight 0 --bag b", "bag = 'b': expected with --over-dds"),
        ("topic --once", "once: expected with a topic"),
    ],
)
def test_wrong_input_is_one_line_with_code_2_and_nothing_is_written(hsv, tmp_path, words, message):
    ran = hsv(*shlex.split(words))
    assert ran.code == 2 and ran.out == ""
    assert ran.error.startswith(message)
    assert not list(tmp_path.iterdir())


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
    assert "limits violated" in ran.error
    assert "not judged" in ran.out and "not judged" not in hsv("simulate", "case1").out


def test_as_a_process_it_fails_on_one_line(tmp_path):
    words = [sys.executable, "-m", "hsv.cli.entry", "simulate", "absent.toml"]
    ran = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert (ran.returncode, ran.stdout, ran.stderr.count("\n")) == (2, "", 1)
    assert ran.stderr.startswith("hsv: error: scenario 'absent.toml'")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", ["simulate case1", "list scenarios", "list faults", "trim", "-h"])
def test_no_columns_in_the_environment_are_no_reason_to_print_nothing(words):
    environment = {**os.environ, "COLUMNS": "0"}
    ran = subprocess.run(["hsv", *words.split()], env=environment, capture_output=True, text=True)
    assert ran.returncode == 0 and len(ran.stdout) > 200


def test_a_target_that_is_no_regular_file_is_refused_at_once(hsv, tmp_path):
    os.mkfifo(tmp_path / "f.mat")
    os.mkfifo(tmp_path / "f.html")
    assert hsv("linearise", "--out", "f.mat").error == "out = 'f.mat': cannot be written (not a regular file)"
    assert hsv("report", str(REFERENCE), "--out", "f.html").code == 2


def test_an_error_has_at_most_2000_characters(hsv, tmp_path):
    (tmp_path / "long.toml").write_text(f'extends = "case1"\ncontroller = "{"x" * 9000}"\n')
    ran = hsv("simulate", "long.toml")
    assert ran.code == 2 and len(ran.err) <= 2000 and " [...] " in ran.error and ran.err.count("\n") == 1


def test_the_head_of_a_help_is_no_failure():
    ran = subprocess.run("set -o pipefail; hsv -h | head -1", shell=True, executable="/bin/bash", capture_output=True)
    assert ran.returncode == 0 and not ran.stderr

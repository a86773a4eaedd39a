"""The commands on designs: hsv design, certify, govern and export-controller."""

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from hsv.certificate.checks import load_subject
from hsv.control.design_file import find_certificate, find_design, read_design, read_parameters, write_design
from hsv.design.inputs import find_inputs
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.flown_checks import verify
from hsv.flight.scenario import load_scenario
from hsv.plugins.c_export import controller_files, step_bounds


@pytest.fixture
def small(tmp_path):
    """Return design inputs that take seconds: four vertices on a grid, one nominal gain, short flights."""
    (tmp_path / "inputs").mkdir()
    path = tmp_path / "inputs" / "small.toml"
    path.write_text(
        'extends = "baseline_single_k"\n'
        '[model]\nrepresentation = "grid"\n'
        "[model.grid]\naltitude_vertices = 2\nvelocity_vertices = 2\n"
        '[disturbance]\nduration = "8 s"\nfault_start = "4 s"\nfault_window = ["4 s", "4 s"]\nshare = 0.5\n'
    )
    return path


@pytest.mark.long
def test_a_design_is_written_here_and_comes_out_alike_on_another_processor(hsv, small, tmp_path, monkeypatch):
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    certificate = here / "small.certificate.json"
    certificate.write_text("an older one")
    ran = hsv("design", str(small), "--force")
    # The set is for half of W: the files are written, and the exit code says that flights leave it.
    assert ran.code == 1 and "certified for 0.5 W; 1025 of 1025 measured flights leave it" in ran.err
    assert ran.err.startswith("about 3 min on one processor for a design of the size of baseline"), ran.err
    assert sorted(path.name for path in here.iterdir()) == ["small.certificate.json", "small.yaml"]
    assert [path.name for path in small.parent.iterdir()] == ["small.toml"]
    made = verify(load_subject(here / "small.yaml"), quick=True, seed=1)
    # A model of four vertices is not accurate enough between them, either.
    failed = {claim.name for claims in made.values() for claim in claims if not claim.ok}
    assert {"share of W", "largest level"} < failed and len(failed) == 4, failed

    # The shipped file with one entry changed: the check names this entry, and all others agree.
    certificate.rename(small.parent / certificate.name)
    shipped = read_parameters(here / "small.yaml")
    entry = repr(shipped["feedback.gain"][12])
    text = (here / "small.yaml").read_text()
    assert text.count(entry) == 1
    small.with_suffix(".yaml").write_text(text.replace(entry, repr(1.01 * float(entry))))
    words = [sys.executable, "-m", "hsv.cli.entry", "design", str(small), "--check", "--json"]
    processor = {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"}
    checked = subprocess.run(words, env=os.environ | processor, capture_output=True, text=True)
    assert checked.returncode == 1
    assert f"feedback.gain[1, 3] = {entry}: expected " in checked.stderr
    scaled = {d["parameter"]: d["scaled"] for d in json.loads(checked.stdout)["deviations"]}
    assert {name for name, deviation in scaled.items() if deviation > 1e-5} == {"feedback.gain"}
    assert sorted(path.name for path in here.iterdir()) == ["small.yaml"]


def test_a_check_writes_nothing_and_takes_no_other_option(hsv, tmp_path):
    ran = hsv("design", "baseline", "--check", "--force")
    assert ran.code == 2 and ran.error.startswith("check: --out, --force or --tau given")
    (tmp_path / "alone.toml").write_text(find_inputs("baseline").read_text())
    ran = hsv("design", "alone.toml", "--check")
    assert ran.code == 2 and ran.error.startswith("design 'alone.yaml': cannot be read")


def test_a_file_that_is_no_design_and_a_missing_certificate_are_named(hsv, tmp_path):
    (tmp_path / "inputs.yaml").write_text("name: a: b\n")
    ran = hsv("certify", "inputs.yaml")
    assert ran.code == 2
    assert ran.error.startswith("design 'inputs.yaml': ") and ran.error.endswith(", expected ROS 2 parameters in YAML")
    (tmp_path / "alone.yaml").write_text(find_design("baseline").read_text())
    ran = hsv("verify", "alone.yaml")
    assert ran.code == 2 and ran.error.startswith("alone.certificate.json: cannot be read")


@pytest.mark.long
def test_a_design_that_misses_its_required_margin_is_refused_and_not_written(hsv, small, tmp_path):
    small.write_text(small.read_text() + "[margins]\nelevator = 0.9\n")
    ran = hsv("design", str(small))
    assert ran.code == 2 and not (tmp_path / "small.yaml").exists()
    expected = "margins.elevator = 0.9: the loop has a disk margin of 0.651 at vertex 1, expected at least 0.9"
    assert ran.err.endswith(f"{expected}\n"), ran.err


@pytest.mark.long
def test_all_corners_are_searched_for_a_smaller_margin_than_the_stated_one(hsv, tmp_path):
    (tmp_path / "own.yaml").write_text(find_design("robust").read_text())
    certificate = json.loads(find_certificate("robust").read_text())
    certificate["margins"]["corners"]["slow"]["unstable"] = 3
    (tmp_path / "own.certificate.json").write_text(json.dumps(certificate))
    ran = hsv("verify", "own.yaml", "--quick", "--corners", "--json")
    claims = [claim for claim in json.loads(ran.out)["claims"] if claim["part"] == "margins at all corners"]
    assert ran.code == 1 and [claim["ok"] for claim in claims] == [True, True, True, False]
    assert ran.error.startswith("margins at all corners: check fails: margins.corners.slow.unstable")


@pytest.mark.parametrize("name", ["baseline.yaml", "baseline.certificate.json"])
def test_a_file_that_exists_is_kept_and_named_before_anything_is_computed(hsv, tmp_path, name):
    (tmp_path / name).write_text("mine")
    for words in (("baseline",), ("adjustable", "--out", "baseline.yaml")):
        ran = hsv("design", *words)
        assert (ran.code, ran.out) == (2, "")
        assert ran.error == f"out = '{name}': exists, expected a new file, or --force to overwrite it"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]


BASELINE = Path(__file__).parents[2] / "offline_design" / "baseline.yaml"


@pytest.mark.long
def test_a_design_is_certified_as_it_was_and_with_a_small_gust(hsv):
    certificate = load_subject(BASELINE).certificate["tube"]
    alone, gust = hsv("certify", str(BASELINE), "--gust", "0.5 ft/s", "--json").json["verdicts"]
    assert (alone["name"], gust["name"]) == ("as certified", "gust 0.5 ft/s")
    assert alone["certified"] and gust["certified"]
    assert_allclose(alone["half_width"], certificate["invariant_set"]["half_width"][:5], rtol=1e-5)
    margins = certificate["tightening"]["plan"]
    assert_allclose(alone["room"], list(zip(margins["margin_to_lower"], margins["margin_to_upper"], strict=True)), 1e-4)
    assert all(wide > narrow for wide, narrow in zip(gust["half_width"], alone["half_width"], strict=True))
    assert min(min(row) for row in gust["room"]) < min(min(row) for row in alone["room"])


@pytest.mark.long
def test_the_sensors_of_a_scenario_are_added_and_what_is_not_covered_is_named(hsv, tmp_path):
    mine = tmp_path / "mine.toml"
    mine.write_text(
        'extends = "case1"\ntitle = "x"\n[sensors.altitude]\nquantum = "1 ft"\n[sensors.velocity]\ndrop_out = 0.01\n'
    )
    ran = hsv("certify", str(BASELINE), "--scenario", str(mine), "--json")
    assert ran.code == 1
    assert ran.json["not_covered"] == [
        "sensors.altitude.quantum: 1 ft; the certificate is for an ideal one",
        "sensors.velocity.drop_out: 0.01; the certificate is for an ideal one",
    ]
    verdicts = {verdict["name"]: verdict["certified"] for verdict in ran.json["verdicts"]}
    assert verdicts["sensor quantisation"] and verdicts["all"] and not verdicts["drop-out of a sensor"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--sensors", "coarse"), "sensors = 'coarse': expected one of ideal, fine, ghv, inertial"),
        (("--bias", "velocity=1 deg"), "bias velocity = '1 deg': wrong unit"),
        (("--gust", "2"), "gust = '2': the unit is missing"),
        (("--reach", "9"), "reach = 9: expected more than 0, up to 8.572, beyond which no noise is"),
        (("--actuators", "servo"), "actuators = 'servo': expected ideal, or names from elevator_50, "),
        (("--actuators", "elevator_50,elevator_20"), "actuators = 'elevator_50,elevator_20': expected at most one a"),
    ],
)
def test_bad_input_is_one_line(hsv, arguments, message):
    ran = hsv("certify", str(BASELINE), *arguments)
    assert ran.code == 2
    assert ran.error.startswith(message)


def test_the_file_that_it_writes_flies_the_reference_inside_the_inputs(hsv, tmp_path):
    path = tmp_path / "governed.toml"
    found = json.loads(hsv("govern", "case1", "--blend", "4 s", "--out", str(path), "--json").out)
    flight = fly(assemble_flight(load_scenario(str(path))))
    metrics = flight.metrics
    assert metrics["saturated_steps"] == 0
    (_, first), (_, last) = ((c["time_s"], c["altitude_m"]) for c in (found["corners"][0], found["corners"][-1]))
    assert flight.reference[[0, -1], 0] == pytest.approx([first, last], rel=1e-12)
    assert found["end_s"] == found["corners"][-1]["time_s"] + found["blend_s"]
    for name, plan in found["plan"].items():
        assert plan["lower_bound"] < plan["least"] < plan["largest"] < plan["upper_bound"], name
    shown = hsv("govern", "case1", "--blend", "4 s", "--units", "paper").out
    assert f"at rest from {found['end_s']:g} s on" in shown


def test_a_file_that_exists_is_kept(hsv, tmp_path):
    path = tmp_path / "kept.toml"
    path.write_text("mine")
    refused = hsv("govern", "case1", "--out", str(path))
    assert (refused.code, path.read_text()) == (2, "mine")
    assert "exists, expected a new file, or --force" in refused.err


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("case1", "--blend", "0 s"), "blend = 0 s: expected above 0"),
        (("case1", "--blend", "1e9 s"), "blend = 1e+09 s: expected above 0 s, up to 600 s"),
        (("case1_rmpc",), "controller = 'robust_mpc', design = 'baseline_single_k': expected tube_mpc"),
        (("case1_qp",), "nominal.law = 'qp': expected 'family'"),
    ],
)
def test_what_cannot_be_governed_is_refused_in_one_line(hsv, arguments, why):
    refused = hsv("govern", *arguments)
    assert refused.code == 2
    assert why in refused.err and refused.err.startswith("hsv: error: ") and refused.err.count("\n") == 1


DESIGN = read_design(find_design("baseline"))


def test_it_writes_source_numbers_and_headers_and_prints_the_cost_of_a_step(hsv, tmp_path):
    ran = hsv("export-controller", "baseline", "--out", "new/controller", "--json")
    assert ran.code == 0
    folder = tmp_path / "new" / "controller"
    texts = controller_files(DESIGN)
    assert {path.name: path.read_text() for path in folder.iterdir()} == texts
    assert {row["path"]: row["size_bytes"] for row in ran.json["written"]} == {
        f"new/controller/{name}": (folder / name).stat().st_size for name in texts
    }
    bounds = {name: dataclasses.asdict(bound) for name, bound in step_bounds(DESIGN).items()}
    assert ran.json["most_in_a_step"] == bounds
    assert bounds["nominal_trajectory"]["multiplications"] > 1000


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("nothing", "--out", "new"), "design = 'nothing': no such file"),
        (("tubeless.yaml", "--out", "new"), "tube.shape: empty, expected a design with a tube"),
        (("baseline", "--out", "full"), "out = 'full': holds notes.txt, expected a new folder"),
        (("baseline", "--out", "full/notes.txt"), "out = 'full/notes.txt': cannot be written"),
        (("baseline", "--out", "full/controller.c"), "out = 'full/controller.c': cannot be written"),
        (("baseline",), "out, fmu: missing, expected --out FOLDER, --fmu FILE or both"),
        (("baseline", "--fmu", "full/notes.txt"), "fmu = 'full/notes.txt': exists, expected a new file"),
    ],
)
def test_wrong_input_is_one_line(hsv, tmp_path, words, expected):
    write_design(tmp_path / "tubeless.yaml", dataclasses.replace(DESIGN, tube=None), "for this test")
    (tmp_path / "full").mkdir()
    for name in ("controller.c", "notes.txt"):
        (tmp_path / "full" / name).touch()
    ran = hsv("export-controller", *words)
    assert ran.code == 2
    assert expected in ran.error
    assert not (tmp_path / "new").exists()
    assert (tmp_path / "full" / "controller.c").read_text() == ""

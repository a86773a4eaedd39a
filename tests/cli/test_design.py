"""Where ``hsv design`` writes, what it does not write over, and whether a design comes out as it was shipped."""

import json
import os
import subprocess
import sys

import pytest

from hsv.control.checks import load_subject
from hsv.control.design import find_design, read_parameters
from hsv.design.inputs import find_inputs
from hsv.flight.verification import verify


@pytest.fixture
def small(tmp_path):
    """An input that takes seconds: four vertices on a grid, one nominal gain, short flights."""
    (tmp_path / "inputs").mkdir()
    path = tmp_path / "inputs" / "small.toml"
    path.write_text(
        'extends = "baseline_single_k"\n'
        '[model]\nrepresentation = "grid"\n'
        "[model.grid]\naltitude_vertices = 2\nvelocity_vertices = 2\n"
        '[disturbance]\nduration = "8 s"\nfault_start = "4 s"\nshare = 0.5\n'
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
    assert ran.code == 0 and ran.err.startswith("about 3 min on one processor for a design of the size of baseline"), (
        ran.err
    )
    assert sorted(path.name for path in here.iterdir()) == ["small.certificate.json", "small.yaml"]
    assert [path.name for path in small.parent.iterdir()] == ["small.toml"]
    assert all(claim.ok for made in verify(load_subject(here / "small.yaml"), quick=True).values() for claim in made)

    # Shipped, but for one entry: the check names that one, all others agree.
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
    assert ran.code == 2 and ran.error.startswith("check: --out, --force, --tau or --compare-sets given")
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


@pytest.mark.parametrize("name", ["baseline.yaml", "baseline.certificate.json"])
def test_a_file_that_exists_is_kept_and_named_before_anything_is_computed(hsv, tmp_path, name):
    (tmp_path / name).write_text("mine")
    for words in (("baseline",), ("adjustable", "--out", "baseline.yaml")):
        ran = hsv("design", *words)
        assert (ran.code, ran.out) == (2, "")
        assert ran.error == f"out = '{name}': exists, expected a new file, or --force to overwrite it"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "mine")]

"""Errors that refuse a run before any process starts."""

import os
import subprocess
import sys
import tempfile

import pytest

from hsv.base.errors import RecordingError
from hsv.control.design_file import find_design, read_design
from hsv.flight.fingerprint import as_published
from hsv.flight.scenario import parse_scenario
from hsv.graph.preparation import RunFolder, RunOptions, prepare


def test_the_bag_is_made_here_so_that_a_second_run_of_its_name_is_refused(tmp_path):
    bag = tmp_path / "new" / "same"
    assert prepare("case1", bag=bag).bag == bag and not list(bag.iterdir())
    with pytest.raises(RecordingError, match=r"bag = .*same.: exists already, expected a new directory"):
        prepare("case1", bag=bag)
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match=r"bag = .*file/x.: cannot be made \(Not a directory\)"):
        prepare("case1", bag=tmp_path / "file" / "x")


@pytest.mark.parametrize("name", ["case1", "case1_rmpc", "case1_integral_heavy", "case2_tau1"])
def test_the_bag_of_a_foreign_controller_keeps_the_scenario_that_is_flown(tmp_path, name):
    for external in (False, True):
        folder = tmp_path / str(external)
        prepared = prepare(name, RunOptions(external=external), bag=folder / "bag", folder=folder)
        kept = parse_scenario((folder / "scenario.toml").read_text(), name)
        assert kept == prepared.scenario and kept.controller.startswith("node:") == external
        # A flight with an external controller is not compared with the published fingerprint.
        design = read_design(find_design(kept.design)).digest
        assert as_published("v1:another", kept, design) is (None if external else False)


def test_the_folder_of_a_killed_run_is_removed_by_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    program = "import os, signal; from hsv.graph.preparation import RunFolder; f = RunFolder(); os.kill(os.getpid(), 9)"
    subprocess.run([sys.executable, "-c", program], env={**os.environ, "TMPDIR": str(tmp_path)}, check=False)
    [killed] = tmp_path.iterdir()
    (tmp_path / "hsv_run_prepared").mkdir()  # by hsv prepare: its launcher removes it
    running = RunFolder()
    other = RunFolder()
    assert not killed.exists()
    assert {*map(str, tmp_path.iterdir())} == {running.name, other.name, str(tmp_path / "hsv_run_prepared")}
    running.cleanup()
    other.cleanup()

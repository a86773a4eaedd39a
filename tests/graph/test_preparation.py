"""What a run is refused for, before any process starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from hsv.base.errors import RecordingError
from hsv.control.design import find_design, read_design
from hsv.flight.fingerprint import as_published
from hsv.flight.scenario import parse_scenario, with_controller
from hsv.graph.preparation import RunOptions, prepare


def test_the_bag_is_made_here_so_that_a_second_run_of_its_name_is_refused(tmp_path: Path) -> None:
    bag = tmp_path / "new" / "same"
    assert prepare("case1", bag=bag).bag == bag and not list(bag.iterdir())
    with pytest.raises(RecordingError, match=r"bag = .*same.: exists already, expected a new directory"):
        prepare("case1", bag=bag)
    (tmp_path / "file").touch()
    with pytest.raises(RecordingError, match=r"bag = .*file/x.: cannot be made \(Not a directory\)"):
        prepare("case1", bag=tmp_path / "file" / "x")


def test_default_names_differ_within_a_second(tmp_path: Path) -> None:
    prepared = [prepare("case1", bags=tmp_path) for _ in range(5)]
    assert len({run.bag for run in prepared}) == 5


@pytest.mark.parametrize("name", ["case1", "case1_rmpc", "case1_integral_heavy", "case2_tau1"])
def test_the_bag_of_a_foreign_controller_keeps_the_scenario_that_is_flown(tmp_path: Path, name: str) -> None:
    for external in (False, True):
        folder = tmp_path / str(external)
        prepared = prepare(name, RunOptions(external=external), bag=folder / "bag", folder=folder)
        kept = parse_scenario((folder / "scenario.toml").read_text(), name)
        assert kept == prepared.scenario and kept.controller.startswith("node:") == external
        # Only the scenario's own controller is compared with the publication.
        design = read_design(find_design(kept.design)).digest
        assert as_published("v1:another", kept, design) is (None if external else False)


@pytest.mark.parametrize("controller", ["tube_mpc", "package.module:Class"])
def test_a_foreign_controller_flies_in_the_same_air(controller: str) -> None:
    text = f"""
title = "wind"
controller = "{controller}"
duration = "1 s"
[initial]
altitude = "85500 ft"
velocity = "7900 ft/s"
[wind]
up = "2 m/s"
"""
    flown = [parse_scenario(text, "wind"), parse_scenario(with_controller(text, "node:", "wind"), "wind")]
    assert flown[0].settings and flown[0].settings == flown[1].settings

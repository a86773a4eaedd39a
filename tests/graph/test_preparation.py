"""What a run is refused for, before any process starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from hsv.errors import RecordingError
from hsv.graph.preparation import prepare


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

"""A flight of the study is a run of the graph, kept as a bag, and the same as one in process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hsv.bags.reader import Bag
from hsv_paper.flights import Flights

pytestmark = pytest.mark.graph

SHORT = "case1_derived_no_notch"
"""Diverges after 17.5 s."""


@pytest.mark.long
def test_a_flight_of_the_graph_is_kept_as_its_bag_and_flown_again_where_that_is_cut_off(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE"):
        monkeypatch.setenv(name, ros_environment[name])
    flown = Flights(tmp_path / "kept", graph=True)[SHORT]
    [kept] = (tmp_path / "kept").iterdir()
    assert Bag(kept).custom_data["scenario"] == SHORT
    [file] = kept.glob("*.mcap")
    recorded = file.read_bytes()
    again, in_process = Flights(kept.parent, graph=True)[SHORT], Flights(tmp_path, graph=False)[SHORT]
    assert file.read_bytes() == recorded
    for name in ("time", "state", "reference", "deviation", "command", "saturated", "gain_index"):
        assert np.array_equal(getattr(flown, name), getattr(in_process, name)), name
        assert np.array_equal(getattr(again, name), getattr(in_process, name)), name

    file.write_bytes(recorded[:100_000])
    Flights(kept.parent, graph=True)[SHORT]
    assert Bag(kept).complete
    assert [path.name for path in kept.parent.iterdir()] == [kept.name]

"""What is told of a flight while it is flown."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from hsv.base.units import UnitSystem
from hsv.graph.snapshot import Snapshot

SNAPSHOT = Snapshot(120.5, 26200.0, -1.234, 0.0596, ("elevator_deflection loss_of_effectiveness",))


@pytest.mark.parametrize("snapshot", [SNAPSHOT, Snapshot(0.0, 1.0, 2.0, None, ())])
def test_a_line_is_read_as_it_was_written(snapshot: Snapshot) -> None:
    assert Snapshot.read(snapshot.line) == snapshot


@pytest.mark.parametrize(
    "line", ["step 50 of 10000", "flight diverged at t = 3.00 s", "", "[INFO] recording to bags/x"]
)
def test_other_lines_are_not_taken_for_one(line: str) -> None:
    assert Snapshot.read(line) is None


def test_people_read_units_and_words() -> None:
    words = SNAPSHOT.in_words(UnitSystem.metric)
    assert "26200 m " in words and "-1.23 m/s" in words and "elevator deflection loss of effectiveness" in words
    assert "85958 ft " in SNAPSHOT.in_words(UnitSystem.paper)


def message(level: float) -> Snapshot:
    fault = SimpleNamespace(channel="pitch_rate", type="bias")
    return Snapshot.of(
        SimpleNamespace(
            header=SimpleNamespace(stamp=SimpleNamespace(sec=3, nanosec=500_000_000)), altitude=5.0, velocity=7.0
        ),
        SimpleNamespace(reference=SimpleNamespace(velocity=6.0)),
        SimpleNamespace(level=level),
        SimpleNamespace(active=[fault]),
    )


def test_a_level_that_is_no_number_is_none() -> None:
    assert message(0.5) == Snapshot(3.5, 5.0, 1.0, 0.5, ("pitch_rate bias",))
    assert message(float("nan")).tube_level is None

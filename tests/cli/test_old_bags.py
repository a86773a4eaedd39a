"""A bag recorded at 4e00631, before flights became portable: it is read, though today's code flies other last bits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hsv_msgs.msg import Run

from hsv.bags.former import INTERFACE_VERSION

OLD = Path(__file__).parents[1] / "bags" / "old_bags" / "case1_4e00631"

Hsv = Callable[..., Any]


def test_info_tells_its_flight(hsv: Hsv) -> None:
    done = hsv("info", str(OLD), "--json")
    assert done.code == 0, done.err
    told = done.json
    assert (told["ending"], told["duration_s"]) == ("finished", 40.0)
    assert [(fault["channel"], fault["start_s"]) for fault in told["faults"]] == [("elevator_deflection", 20.0)]
    # 600 ft and 250 ft/s, commanded at the start.
    assert told["metrics"]["altitude_error_maximum_m"] == pytest.approx(182.88)
    assert told["metrics"]["velocity_error_maximum_m_per_s"] == pytest.approx(76.2)
    assert told["fingerprint"].startswith("v1:")
    assert told["as_published"] is None


@pytest.mark.parametrize(
    ("command", "made"),
    [
        (("plot", "--out", "plot.png"), "plot.png"),
        (("report", "--out", "report.html"), "report.html"),
        (("export", "--out", "tables", "--csv"), "tables/hsv_state.csv"),
    ],
)
def test_its_pages_and_tables_are_made(hsv: Hsv, tmp_path: Path, command: tuple[str, ...], made: str) -> None:
    name, *options = command
    done = hsv(name, str(OLD), *options)
    assert done.code == 0, done.err
    assert (tmp_path / made).stat().st_size > 10_000


def test_diff_compares_it(hsv: Hsv) -> None:
    assert hsv("diff", str(OLD), str(OLD)).code == 0


@pytest.mark.parametrize("options", [(), ("--rerun",), ("--over-dds", "--node", "tube_mpc")], ids=" ".join)
def test_replay_tells_its_version_and_the_one_expected(hsv: Hsv, options: tuple[str, ...]) -> None:
    done = hsv("replay", str(OLD), *options)
    assert done.code == 2
    commit = hsv("info", str(OLD), "--json").json["custom_data"]["commit"]
    assert done.error.endswith(f": interface version 1, recorded by commit {commit}: expected version 2")


def test_the_version_expected_is_that_of_the_messages() -> None:
    assert Run.INTERFACE_VERSION == INTERFACE_VERSION

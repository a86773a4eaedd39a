"""Bags that lack something: a warning where the result is whole, one line and exit code 2 where it is not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flown_bags import flown_bag

from hsv.recording.reader import Bag
from hsv.recording.topic import Topic
from hsv.recording.writer import BagWriter

Hsv = Callable[..., Any]

RESULTS = {
    "info": [],
    "replay": [],
    "export": ["--npz", "--out", "out.npz"],
    "report": ["--out", "out.html"],
    "plot": ["--out", "out.png"],
}
"""Commands that need most of a bag, with what they write."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_bag(tmp_path_factory.mktemp("bags") / "flown")


@pytest.fixture(scope="module")
def cut(bag: Path) -> Path:
    """The bag of a recorder that was killed near the end."""
    path = bag.parent / "cut.mcap"
    data = next(bag.glob("*.mcap")).read_bytes()
    path.write_bytes(data[: len(data) * 85 // 100])
    return path


@pytest.fixture
def without(bag: Path, tmp_path: Path) -> Callable[[str], Path]:
    """Return the bag without one of its topics."""

    def make(topic: str) -> Path:
        recorded = Bag(bag)
        kept = [
            Topic(t.name, t.type, recorded.definition(t.name), t.type_hash, recorded.qos(t.name))
            for t in recorded.topics.values()
            if t.name != topic
        ]
        writer = BagWriter(tmp_path / "partial", kept, recorded.custom_data)
        for name, data in recorded.attachments.items():
            writer.attach(name, recorded.media_types[name], data)
        for kind in kept:
            for time, message in recorded.messages(kind.name):
                writer.write(kind.name, time, message)
        writer.close()
        return tmp_path / "partial"

    return make


@pytest.mark.parametrize("command", RESULTS)
def test_a_bag_that_is_cut_off_is_used_and_said_to_be_cut_off(
    hsv: Hsv, cut: Path, tmp_path: Path, command: str
) -> None:
    ran = hsv(command, str(cut), *RESULTS[command])
    assert ran.code == 0
    assert ran.err.count("\n") == 1
    assert ran.err.startswith(f"hsv: warning: {cut}: cut off after ") and "hsv recover mends it" in ran.err
    assert RESULTS[command] == [] or (tmp_path / RESULTS[command][-1]).is_file()


def test_diff_says_which_of_the_two_is_cut_off(hsv: Hsv, bag: Path, cut: Path) -> None:
    ran = hsv("diff", str(bag), str(cut))
    assert ran.code == 1 and "number of messages" in ran.out
    assert ran.err.startswith(f"hsv: warning: {cut}: cut off after ") and ran.err.count("\n") == 1


@pytest.mark.parametrize("command", ["info", "export", "report", "plot"])
def test_a_topic_that_is_not_needed_may_be_missing(
    hsv: Hsv, without: Callable[[str], Path], tmp_path: Path, command: str
) -> None:
    partial = without("/hsv/forces")
    ran = hsv(command, str(partial), *RESULTS[command])
    assert ran.code == 0
    assert ran.err == f"hsv: warning: {partial / 'partial_0.mcap'}: no topic /hsv/forces\n"
    assert RESULTS[command] == [] or (tmp_path / RESULTS[command][-1]).is_file()


@pytest.mark.parametrize("command", ["replay", "report", "plot", "export", "diff", "info"])
def test_a_topic_that_is_needed_is_missing(
    hsv: Hsv, bag: Path, without: Callable[[str], Path], tmp_path: Path, command: str
) -> None:
    partial = without("/hsv/command")
    words = [*RESULTS.get(command, [str(bag)])]
    ran = hsv(command, str(partial), *words, *(["--topic", "/hsv/command"] if command == "export" else []))
    assert ran.code == 2
    assert ran.error.startswith(f"{partial / 'partial_0.mcap'}: no topic /hsv/command, only /clock, ")
    assert [path.name for path in tmp_path.iterdir()] == ["partial"]
    assert (ran.out != "") is (command == "info"), "what else is in it helps to find out why"


def test_what_both_bags_lack_is_no_difference(hsv: Hsv, without: Callable[[str], Path]) -> None:
    partial = without("/hsv/forces")
    ran = hsv("diff", str(partial), str(partial))
    assert ran.code == 0 and ran.out.endswith("messages: identical\n")
    assert ran.err.endswith(": no topic /hsv/forces\n") and ran.err.count("\n") == 1


def test_a_bag_without_a_step_is_refused(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    recorded = Bag(bag)
    kinds = [
        Topic(t.name, t.type, recorded.definition(t.name), t.type_hash, recorded.qos(t.name))
        for t in recorded.topics.values()
    ]
    BagWriter(tmp_path / "stillborn", kinds).close()
    for command in ("info", "report", "plot"):
        ran = hsv(command, str(tmp_path / "stillborn"))
        assert ran.code == 2 and "holds no complete step, expected a flight" in ran.error


@pytest.mark.parametrize("command", ["export", "report", "plot"])
def test_what_was_written_is_told_as_json(hsv: Hsv, bag: Path, tmp_path: Path, command: str) -> None:
    (written,) = hsv(command, str(bag), *RESULTS[command], "--json").json["written"]
    assert written == {
        "path": RESULTS[command][-1],
        "size_bytes": (tmp_path / RESULTS[command][-1]).stat().st_size,
    }


def test_flights_of_one_scenario_are_all_plotted(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    other = flown_bag(tmp_path / "other", fault=8.0)
    assert hsv("plot", str(bag), str(other), "--out", "both.svg").code == 0
    text = (tmp_path / "both.svg").read_text()
    assert "short (flown)" in text and "short (other)" in text

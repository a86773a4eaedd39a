"""Bags that lack something: a warning where the result is whole, one line and exit code 2 where it is not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changed_bags import changed_bag
from flown_bags import flown_bag
from marking import long
from mcap.reader import make_reader

from hsv.bags.flight import flight_data, labels
from hsv.bags.metadata import FILE_NAME
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.flight.metrics import flight_metrics

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
        return changed_bag(bag, tmp_path / "partial", lambda kind: None if kind.name == topic else kind)

    return make


@pytest.mark.parametrize("command", [command if command == "info" else long(command) for command in RESULTS])
def test_a_bag_that_is_cut_off_is_used_and_said_to_be_cut_off(
    hsv: Hsv, cut: Path, tmp_path: Path, command: str
) -> None:
    ran = hsv(command, str(cut), *RESULTS[command])
    assert ran.code == 0
    assert ran.err.count("\n") == 1
    assert ran.err.startswith(f"hsv: warning: {cut}: truncated after ") and "hsv recover completes it" in ran.err
    assert RESULTS[command] == [] or (tmp_path / RESULTS[command][-1]).is_file()


@pytest.mark.parametrize("command", ["info", long("replay"), long("export"), long("report"), long("plot")])
def test_metadata_that_contradict_their_file_are_named_once_and_not_believed(
    hsv: Hsv, bag: Path, tmp_path: Path, command: str
) -> None:
    lying = shutil.copytree(bag, tmp_path / "lying")
    (file,), count = lying.glob("*.mcap"), sum(topic.count for topic in Bag(bag).topics.values())
    metadata = lying / FILE_NAME
    metadata.write_text(metadata.read_text().replace(f"message_count: {count}", "message_count: 7"))
    ran = hsv(command, str(lying), *RESULTS[command])
    assert ran.code == 0
    said = f"metadata.yaml states 7 messages in {file.name}, which has {count}"
    assert ran.err == f"hsv: warning: {file}: {said}\n"


def test_diff_says_which_of_the_two_is_cut_off(hsv: Hsv, bag: Path, cut: Path) -> None:
    ran = hsv("diff", str(bag), str(cut))
    assert ran.code == 1 and "number of messages" in ran.out
    assert ran.err.startswith(f"hsv: warning: {cut}: truncated after ") and ran.err.count("\n") == 1


@pytest.mark.parametrize("command", ["export", long("report")])
def test_a_topic_that_is_not_needed_may_be_missing(
    hsv: Hsv, without: Callable[[str], Path], tmp_path: Path, command: str
) -> None:
    partial = without("/hsv/forces")
    ran = hsv(command, str(partial), *RESULTS[command])
    assert ran.code == 0
    assert ran.err == f"hsv: warning: {partial / 'partial_0.mcap'}: no topic /hsv/forces\n"
    assert RESULTS[command] == [] or (tmp_path / RESULTS[command][-1]).is_file()


@pytest.mark.parametrize("topic", ["/hsv/command", long("/hsv/state"), long("/hsv/nominal"), long("/hsv/actuator")])
def test_info_of_a_filtered_bag_says_what_it_lacks(hsv: Hsv, without: Callable[[str], Path], topic: str) -> None:
    partial = without(topic)
    ran = hsv("info", str(partial))
    assert ran.code == 0 and ran.out.endswith(f"no metrics: they need {topic}\n")
    assert ran.err == f"hsv: warning: {partial / 'partial_0.mcap'}: no topic {topic}\n"
    described = hsv("info", str(partial), "--json").json
    assert described["metrics"] is None and described["messages"] > 1000


@pytest.mark.parametrize("command", ["replay", "export"])
def test_a_topic_that_is_needed_is_missing(
    hsv: Hsv, without: Callable[[str], Path], tmp_path: Path, command: str
) -> None:
    partial = without("/hsv/command")
    words = RESULTS.get(command, [])
    ran = hsv(command, str(partial), *words, *(["--topic", "/hsv/command"] if command == "export" else []))
    assert ran.code == 2
    assert ran.error.startswith(f"{partial / 'partial_0.mcap'}: no topic /hsv/command, only /clock, ")
    assert [path.name for path in tmp_path.iterdir()] == ["partial"] and ran.out == ""


def test_a_topic_of_one_bag_alone_is_told_and_the_rest_compared(
    hsv: Hsv, bag: Path, without: Callable[[str], Path]
) -> None:
    ran = hsv("diff", str(bag), str(without("/hsv/tube_status")))
    assert ran.code == 1
    assert ran.out.splitlines() == [f"/hsv/tube_status is in {Bag(bag).path} only", "4808 messages: identical"]


def test_a_bag_without_a_step_is_refused(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    BagWriter(tmp_path / "stillborn", Bag(bag).topics.values()).close()
    for command in ("info", "report", "plot"):
        ran = hsv(command, str(tmp_path / "stillborn"))
        assert ran.code == 2 and "holds no complete step, expected a flight" in ran.error


@pytest.mark.parametrize("command", ["info", *map(long, ("replay", "report", "plot", "export"))])
def test_a_lost_message_is_said_and_no_row_is_taken_for_another(
    hsv: Hsv, bag: Path, tmp_path: Path, command: str
) -> None:
    lost, step = "/hsv/nominal", 300
    holed = changed_bag(
        bag,
        tmp_path / "holed",
        messages=lambda topic, found: [m for k, m in enumerate(found) if (topic, k) != (lost, step)],
    )
    ran = hsv(command, str(holed), *RESULTS[command])
    assert ran.code == (1 if command == "replay" else 0)
    said = f"holed_0.mcap: {lost} lacks 1 of 601 steps, the first at t = 6.00 s"
    assert ran.err.splitlines()[0] == f"hsv: warning: {holed}/{said}"
    whole, joined = flight_data(Bag(bag)), flight_data(Bag(holed))
    for name in ("time", "state", "reference", "deviation", "command"):
        assert np.array_equal(np.delete(getattr(whole, name), step, axis=0), getattr(joined, name)), name
    expected = flight_metrics(whole)
    for name, value in flight_metrics(joined).items():
        assert value == pytest.approx(expected[name], rel=1e-2), name


@pytest.mark.long
def test_a_recovered_bag_is_replayed_as_far_as_it_is_complete(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    last = {"/hsv/nominal", "/hsv/command", "/hsv/tube_status", "/hsv/actuator"}
    ragged = changed_bag(bag, tmp_path / "ragged", messages=lambda topic, found: found[:-1] if topic in last else found)
    file = ragged / "ragged_0.mcap"
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    end = max(index.chunk_start_offset + index.chunk_length for index in summary.chunk_indexes)
    (ragged / "metadata.yaml").unlink()
    file.write_bytes(file.read_bytes()[: end + 1])
    assert hsv("recover", str(ragged), "--out", "repaired").code == 0
    ragged = tmp_path / "repaired"
    ran = hsv("replay", str(ragged))
    assert ran.code == 0 and ran.err == "" and ran.out.count("identical in every byte") == 5
    assert hsv("replay", str(ragged), "--rerun").code == 0
    assert hsv("info", str(ragged), "--json").json["ending"] == "broken off"
    # Of a bag in which nothing is missing, the end is the end.
    whole = changed_bag(bag, tmp_path / "whole")
    data = whole / "whole_0.mcap"
    data.write_bytes(data.read_bytes()[:-9])
    assert hsv("recover", str(whole), "--out", "whole_again").code == 0
    assert hsv("info", "whole_again", "--json").json["ending"] == "finished"


@pytest.mark.long
def test_flights_whose_folders_have_one_name_are_all_plotted(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    paths = [changed_bag(bag, tmp_path / name / "c") for name in ("da", "db")]
    assert labels([Bag(path) for path in paths]) == [f"short ({path / 'c_0.mcap'})" for path in paths]
    words = [str(paths[0].relative_to(tmp_path)), str(paths[1].relative_to(tmp_path))]
    assert hsv("plot", *words, words[1], "--out", "three.svg").code == 0
    text = (tmp_path / "three.svg").read_text()
    for label in ("short (da/c/c_0.mcap)", "short (db/c/c_0.mcap, 2)", "short (db/c/c_0.mcap, 3)"):
        assert label in text


def test_diff_takes_padding_for_no_difference(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    padded = changed_bag(
        bag,
        tmp_path / "padded",
        messages=lambda topic, found: [(time, data + b"\0" * (topic == "/clock")) for time, data in found],
    )
    ran = hsv("diff", str(bag), str(padded), "--json")
    assert ran.code == 0 and ran.json["equal"] and ran.json["identical"]
    assert "identical in every byte except the padding" in hsv("diff", str(bag), str(padded)).out

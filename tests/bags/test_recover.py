"""A killed writer leaves all but its last chunk, and recovery makes a proper bag of that."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from full_disk import files_no_larger_than
from rosbags.rosbag2 import Reader

from hsv.bags.reader import Bag
from hsv.bags.recover import finalise, recover
from hsv.bags.writer import CHUNK_BYTES, BagWriter
from hsv.base.errors import RecordingError

DATA = 200
WRITER = f"""
import itertools, sys
from pathlib import Path
from hsv.bags.definitions import definition, type_hash
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import BagWriter
kind = "hsv_msgs/msg/VehicleState"
qos = Qos(depth=1, durability="transient_local")
topics = [Topic(f"/hsv/t{{i}}", kind, definition(kind), type_hash(kind), qos) for i in range(3)]
writer = BagWriter(Path(sys.argv[1]), topics, {{"run_id": "killed"}})
writer.attach("scenario.toml", "application/toml", b"x = 1")
for step in itertools.count():
    for topic in topics:
        writer.write(topic.name, step, step.to_bytes({DATA}, "little"))
    if step % 100 == 0:
        print(step, flush=True)
"""


@pytest.fixture
def killed(tmp_path: Path) -> tuple[Path, int]:
    """A bag whose writing process was killed, and the last step it said to have written."""
    path = tmp_path / "killed"
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if int(line) >= 1000:
            break
    time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    last = int([line, *process.stdout.read().split()][-1])
    assert process.wait() == -signal.SIGKILL
    return path, last


def test_killed_writer_loses_its_last_chunk_only(killed: tuple[Path, int]) -> None:
    path, last = killed
    bag = Bag(path)
    assert not bag.complete and not (path / "metadata.yaml").exists()
    assert bag.attachments == {"scenario.toml": b"x = 1"} and bag.custom_data == {"run_id": "killed"}
    for name in ("/hsv/t0", "/hsv/t1", "/hsv/t2"):
        steps = bag.times(name).tolist()
        assert steps == list(range(len(steps)))
        assert len(steps) > last - CHUNK_BYTES // (3 * DATA)
        assert bag.messages(name)[-1][1] == steps[-1].to_bytes(DATA, "little")


@pytest.mark.parametrize("in_place", [False, True], ids=["new bag", "in place"])
def test_recovered_bag_is_a_proper_one(killed: tuple[Path, int], in_place: bool) -> None:
    path, _ = killed
    before = Bag(path)
    data = before.path.read_bytes()
    messages = sum(topic.count for topic in before.topics.values())
    if in_place:
        finalise(path)
    else:
        recovery = recover(path)
        assert recovery.changed and recovery.path == path.with_name("killed_recovered")
        assert recovery.messages == messages and before.path.read_bytes() == data
        assert list(path.iterdir()) == [before.path]
        path = recovery.path
    bag = Bag(path)
    assert bag.complete and not bag.loss
    assert bag.topics == before.topics and bag.attachments == before.attachments
    assert bag.custom_data == {"run_id": "killed", "recovered": "true"}
    assert all(bag.messages(name) == before.messages(name) for name in bag.topics)
    told = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert told["message_count"] == messages and told["custom_data"] == bag.custom_data
    topic = told["topics_with_message_count"][0]["topic_metadata"]
    assert topic["offered_qos_profiles"][0]["durability"] == "transient_local"
    assert topic["type_description_hash"] == bag.topics["/hsv/t0"].type_hash != ""
    with Reader(path) as reader:
        assert reader.message_count == messages
    assert sorted(file.name for file in path.iterdir()) == [f"{path.name}_0.mcap", "metadata.yaml"]
    assert not recover(path).changed


@pytest.fixture
def whole(kit: SimpleNamespace, tmp_path: Path) -> Path:
    writer = BagWriter(tmp_path / "whole", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    writer.attach("scenario.toml", "application/toml", b"x = 1")
    for step in range(300):
        writer.write("/hsv/state", step, kit.messages.stamped("hsv_msgs/msg/VehicleState", step, step))
    writer.close()
    return tmp_path / "whole"


def test_cut_anywhere_it_opens_recovers_or_says_why(whole: Path, tmp_path: Path) -> None:
    data = (whole / "whole_0.mcap").read_bytes()
    complete = Bag(whole).messages("/hsv/state")
    counts = []
    for number, length in enumerate(range(0, len(data), 509)):
        path = tmp_path / f"cut{number}"
        path.mkdir()
        (path / "cut_0.mcap").write_bytes(data[:length])
        try:
            recovery = recover(path)
        except RecordingError as error:
            assert "\n" not in str(error) and not counts
            continue
        counts.append(recovery.messages)
        bag = Bag(recovery.path)
        assert bag.complete and bag.messages("/hsv/state") == complete[: recovery.messages]
        with Reader(recovery.path) as reader:
            assert reader.message_count == recovery.messages
    assert counts == sorted(counts) and counts[0] < 150 and counts[-1] == 300


def test_zeros_after_the_end_are_no_records(whole: Path) -> None:
    file = whole / "whole_0.mcap"
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2] + bytes(4096))
    assert 0 < recover(whole).messages < 300


def test_missing_or_broken_metadata_are_written_for_the_new_bag(whole: Path) -> None:
    metadata, file = whole / "metadata.yaml", whole / "whole_0.mcap"
    before, data = metadata.read_text(), file.read_bytes()
    assert not recover(whole).changed
    for number, broken in enumerate(
        (None, "", "no: [metadata", before[: len(before) // 3], before.replace("300", "299"))
    ):
        metadata.unlink()
        if broken is not None:
            metadata.write_text(broken)
        recovery = recover(file, whole.with_name(f"new{number}"))
        assert recovery.changed and file.read_bytes() == data
        with Reader(recovery.path) as reader:
            assert reader.message_count == 300
        metadata.write_text(before)


def test_a_bag_that_is_being_recorded_is_left_alone(kit: SimpleNamespace, tmp_path: Path) -> None:
    path = tmp_path / "live"
    writer = BagWriter(path, [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    for step in range(100):
        writer.write("/hsv/state", step, kit.messages.stamped("hsv_msgs/msg/VehicleState", step, step))
    before = writer.path.stat()
    with pytest.raises(RecordingError, match=r"live_0\.mcap: is being recorded"):
        recover(path)
    assert writer.path.stat() == before and list(path.iterdir()) == [writer.path]
    writer.close()
    assert not recover(path).changed and Bag(path).topics["/hsv/state"].count == 100


def test_a_full_disk_leaves_the_bag_as_it_was(killed: tuple[Path, int]) -> None:
    path, _ = killed
    file = path / "killed_0.mcap"
    data = file.read_bytes()
    problem = r"killed_0\.mcap: cannot be repaired: File too large"
    with pytest.raises(RecordingError, match=problem), files_no_larger_than(len(data) // 2):
        finalise(path)
    assert list(path.iterdir()) == [file] and file.read_bytes() == data
    with pytest.raises(RecordingError, match="cannot be written: File too large"), files_no_larger_than(len(data) // 2):
        recover(path)
    assert list(path.parent.iterdir()) == [path] and file.read_bytes() == data

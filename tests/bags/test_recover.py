"""A killed writer loses only its last chunk, and recovery completes the bag."""

import pytest
import yaml
from full_disk import files_no_larger_than
from rosbags.rosbag2 import Reader

from hsv.bags.reader import Bag
from hsv.bags.recover import finalise, recover
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError


@pytest.fixture
def whole(kit, tmp_path):
    writer = BagWriter(tmp_path / "whole", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState", kit.latched)])
    writer.attach("scenario.toml", "application/toml", b"x = 1")
    for step in range(300):
        writer.write("/hsv/state", step, kit.messages.stamped("hsv_msgs/msg/VehicleState", step, step))
    writer.close()
    return tmp_path / "whole"


@pytest.fixture
def killed(whole):
    """Return the bag of a killed writer, without the end of its file and without metadata.yaml."""
    (whole / "metadata.yaml").unlink()
    file = whole.rename(whole.with_name("killed")) / "whole_0.mcap"
    data = file.read_bytes()
    file.unlink()
    (file.parent / "killed_0.mcap").write_bytes(data[: len(data) * 2 // 3])
    return file.parent


@pytest.mark.parametrize("in_place", [False, True], ids=["new bag", "in place"])
def test_recovered_bag_is_a_proper_one(killed, in_place):
    path, before = killed, Bag(killed)
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
    assert bag.custom_data == {"recovered": "true"}
    assert all(bag.messages(name) == before.messages(name) for name in bag.topics)
    told = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert told["message_count"] == messages and told["custom_data"] == bag.custom_data
    topic = told["topics_with_message_count"][0]["topic_metadata"]
    assert topic["offered_qos_profiles"][0]["durability"] == "transient_local"
    with Reader(path) as reader:
        assert reader.message_count == messages
    assert sorted(file.name for file in path.iterdir()) == [f"{path.name}_0.mcap", "metadata.yaml"]
    assert not recover(path).changed


def test_cut_anywhere_it_opens_recovers_or_says_why(whole, tmp_path):
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


def test_missing_or_broken_metadata_are_written_for_the_new_bag(whole):
    metadata, file = whole / "metadata.yaml", whole / "whole_0.mcap"
    before, data = metadata.read_text(), file.read_bytes()
    assert not recover(whole).changed
    for number, broken in enumerate((None, "no: [metadata", before.replace("300", "299"))):
        metadata.unlink()
        if broken is not None:
            metadata.write_text(broken)
        recovery = recover(file, whole.with_name(f"new{number}"))
        assert recovery.changed and file.read_bytes() == data
        with Reader(recovery.path) as reader:
            assert reader.message_count == 300
        metadata.write_text(before)


def test_a_bag_that_is_being_recorded_is_left_alone(kit, tmp_path):
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


def test_a_full_disk_leaves_the_bag_as_it_was(killed):
    path, file = killed, killed / "killed_0.mcap"
    data = file.read_bytes()
    problem = r"killed_0\.mcap: cannot be repaired: File too large"
    with pytest.raises(RecordingError, match=problem), files_no_larger_than(len(data) // 2):
        finalise(path)
    assert list(path.iterdir()) == [file] and file.read_bytes() == data
    with pytest.raises(RecordingError, match="cannot be written: File too large"), files_no_larger_than(len(data) // 2):
        recover(path)
    assert list(path.parent.iterdir()) == [path] and file.read_bytes() == data

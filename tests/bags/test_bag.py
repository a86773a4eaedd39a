"""Written bags are read back, by our reader and by those of other tools."""

from pathlib import Path

import pytest
import yaml
from full_disk import files_no_larger_than
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, Writer
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader

from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError

STEPS = 120


@pytest.fixture
def written(kit, tmp_path):
    """Return a bag with all our message types, a latched topic and one first seen in flight, and its contents."""
    names = {f"/hsv/any_{name.rpartition('/')[2].lower()}": name for name in kit.types}
    topics = [kit.topic(name, kind, kit.latched if kind.endswith("/Ready") else None) for name, kind in names.items()]
    writer = BagWriter(tmp_path / "run", topics, {"run_id": "17e5", "commit": "0123"})
    writer.attach("scenario.toml", "application/toml", b"duration = '4 s'\n")
    writer.attach("empty", "text/plain", b"")
    log = []
    for step in range(STEPS):
        if step == 30:
            writer.add_topic(kit.topic("/clock", "rosgraph_msgs/msg/Clock"))
            names["/clock"] = "rosgraph_msgs/msg/Clock"
        for name, kind in names.items():
            if not kind.endswith("/Ready") or step == 0:
                given = {"clock": kit.messages.time(step * 10**7)} if name == "/clock" else {}
                data = kit.messages.serialize(kit.messages.make(kind, **given))
                log.append((name, step * 10**7, data))
                writer.write(*log[-1])
    writer.close({"outcome": ""})
    return tmp_path / "run", log


def test_round_trip(written):
    path, log = written
    for given in (path, path / "run_0.mcap"):
        bag = Bag(given)
        assert bag.complete
        assert bag.custom_data == {"run_id": "17e5", "commit": "0123", "outcome": ""}
        assert bag.attachments == {"scenario.toml": b"duration = '4 s'\n", "empty": b""}
        assert bag.span == (0, (STEPS - 1) * 10**7)
        for name, topic in bag.topics.items():
            expected = [(time, data) for other, time, data in log if other == name]
            assert bag.messages(name) == expected
            assert topic.count == len(expected)
            assert bag.times(name).tolist() == [time for time, _ in expected]


def test_metadata_are_those_that_jazzy_demands(written):
    path, log = written
    text = (path / "metadata.yaml").read_text()
    assert 'compression_format: ""\n' in text and 'compression_mode: ""\n' in text and 'outcome: ""\n' in text
    assert 'run_id: "17e5"\n' in text and "~" not in text and "null" not in text
    data = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert (data["version"], data["storage_identifier"], data["ros_distro"]) == (9, "mcap", "jazzy")
    assert data["duration"] == {"nanoseconds": (STEPS - 1) * 10**7}
    assert data["starting_time"] == {"nanoseconds_since_epoch": 0}
    (file,) = data["files"]
    assert set(file) == {"path", "starting_time", "duration", "message_count"} and file["message_count"] == len(log)
    endless = {"sec": 9223372036, "nsec": 854775807}
    for entry in data["topics_with_message_count"]:
        topic = entry["topic_metadata"]
        (profile,) = topic["offered_qos_profiles"]
        assert profile["durability"] == ("transient_local" if topic["type"].endswith("/Ready") else "volatile")
        assert profile["deadline"] == profile["lifespan"] == profile["liveliness_lease_duration"] == endless
        assert topic["type_description_hash"].startswith("RIHS01_") and len(topic["type_description_hash"]) == 71


def test_the_file_itself_holds_the_metadata_for_reindexing(written):
    path, _ = written
    with (path / "run_0.mcap").open("rb") as stream:
        (record,) = (r.metadata for r in make_reader(stream).iter_metadata() if r.name == "rosbag2")
    told = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert yaml.safe_load(record["serialized_metadata"]) == told


@pytest.mark.parametrize("encoding", ["ros2msg", "ros2idl"])
def test_topics_of_others_that_cannot_be_decoded_are_left_alone(kit, tmp_path, encoding):
    path = tmp_path / "mixed.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        topic = kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")
        foreign = writer.register_schema("other_msgs/msg/Odd", encoding, b"Nowhere what\n")
        ours = writer.register_schema(topic.type, "ros2msg", topic.definition.encode())
        channels = [writer.register_channel("/odd", "cdr", foreign), writer.register_channel(topic.name, "cdr", ours)]
        for step in range(3):
            writer.add_message(channels[0], step, b"\0\1\0\0", step)
            writer.add_message(channels[1], step, kit.messages.stamped(topic.type, step, step), step)
        writer.finish()
    bag = Bag(path)
    assert bag.columns("/hsv/state")["step"].tolist() == [0, 1, 2] and not bag.loss
    with pytest.raises(RecordingError, match="/odd"):
        bag.columns("/odd")


def test_rosbags_reads_it_all(written):
    path, log = written
    with Reader(path) as reader:
        assert reader.message_count == len(log)
        assert sorted((c.topic, time, bytes(data)) for c, time, data in reader.messages()) == sorted(log)
        qos = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
        assert qos["/hsv/any_ready"].durability == QosDurability.TRANSIENT_LOCAL
        assert qos["/hsv/any_vehiclestate"].reliability == QosReliability.RELIABLE


def test_bag_without_messages(kit, tmp_path):
    BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")]).close()
    bag = Bag(tmp_path / "bag")
    assert bag.complete and bag.topics["/hsv/state"].count == 0 and bag.span == (0, 0)
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 0


def test_writer_refuses(kit, tmp_path):
    topic = kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")
    writer = BagWriter(tmp_path / "bag", [topic])
    for refused, word in [
        (lambda: BagWriter(tmp_path / "bag"), "exists already"),
        (lambda: writer.add_topic(topic), "/hsv/state"),
        (lambda: writer.write("/hsv/other", 0, b""), "/hsv/other"),
    ]:
        with pytest.raises(RecordingError, match=word):
            refused()


def test_full_disk_is_one_clear_line(kit, tmp_path):
    writer = BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    problem = r"bag_0\.mcap: cannot be written: File too large"
    with pytest.raises(RecordingError, match=problem), files_no_larger_than(10_000):
        for step in range(1000):
            writer.write("/hsv/state", step, kit.messages.random.bytes(200))


def test_a_bag_of_others_is_refused(kit, tmp_path):
    BagWriter(tmp_path / "other", [kit.topic("/clock", "rosgraph_msgs/msg/Clock")]).close()
    with pytest.raises(RecordingError, match="no topic below /hsv/"):
        Bag(tmp_path / "other")


@pytest.mark.parametrize(
    ("data", "word"),
    [(None, "holds no file"), (b"", "truncated"), (b"SQLite format 3\0", "not an MCAP"), (MCAP0_MAGIC, "truncated")],
    ids=["empty directory", "empty file", "other format", "magic only"],
)
def test_unusable_input_is_one_clear_line(data, word, tmp_path):
    if data is not None:
        (tmp_path / "bag.mcap").write_bytes(data)
    with pytest.raises(RecordingError, match=word) as error:
        Bag(tmp_path)
    assert "\n" not in str(error.value) and str(tmp_path) in str(error.value)


def test_missing_topics_are_named(written):
    bag = Bag(written[0])
    for ask in (bag.columns, bag.messages, bag.times, bag.constants):
        with pytest.raises(RecordingError, match="no topic /hsv/nowhere, only /clock"):
            ask("/hsv/nowhere")


def test_message_that_does_not_fit_its_definition_is_named(kit, tmp_path):
    writer = BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    writer.write("/hsv/state", 5, b"\x00\x01\x00\x00" + bytes(4) + b"\x05" + bytes(15))
    writer.close()
    with pytest.raises(RecordingError, match="topic /hsv/state: message at 5 ns") as error:
        Bag(tmp_path / "bag").columns("/hsv/state")
    assert "\n" not in str(error.value)


def _two_channels(path, kit, kinds):
    """Write a bag in which one topic has two channels."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        channels = []
        for kind in kinds:
            topic = kit.topic("/hsv/other", kind)
            schema = writer.register_schema(kind, "ros2msg", topic.definition.encode())
            channels.append(writer.register_channel(topic.name, "cdr", schema, {"number": str(len(channels))}))
        for step in range(10):
            data = kit.messages.stamped(kinds[step % 2], step, step)
            writer.add_message(channels[step % 2], step, data, step, step)
        writer.finish()
    return path


def test_two_channels_of_a_topic_are_one(kit, tmp_path):
    state, forces = "hsv_msgs/msg/VehicleState", "hsv_msgs/msg/VehicleForces"
    bag = Bag(_two_channels(tmp_path / "both.mcap", kit, (state, state)))
    assert bag.topics["/hsv/other"].count == 10
    assert bag.times("/hsv/other").tolist() == bag.columns("/hsv/other")["step"].tolist() == list(range(10))
    with pytest.raises(RecordingError, match="/hsv/other: recorded with two definitions"):
        Bag(_two_channels(tmp_path / "mixed.mcap", kit, (state, forces)))


def test_a_topic_is_a_table_with_units():
    bag = Bag(Path(__file__).parents[2] / "bags" / "reference" / "case1")
    frame = bag.to_frame("hsv/state")
    assert frame.index.name == "time" and len(frame) == len(bag.times("hsv/state"))
    assert frame["altitude"].tolist() == bag.columns("hsv/state")["altitude"].tolist()
    assert frame.attrs["units"].keys() == {"time", *frame.columns} and frame.attrs["units"]["altitude"] == "m"

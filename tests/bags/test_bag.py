"""What is written is read back: by us, and by what others use."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from full_disk import files_no_larger_than
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader

from hsv.bags.reader import Bag
from hsv.bags.recover import recover
from hsv.bags.topic import INFINITE, Qos
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError

Written = tuple[Path, list[tuple[str, int, bytes]]]
STEPS = 120
REQUIRED = {
    "version",
    "storage_identifier",
    "duration",
    "starting_time",
    "message_count",
    "topics_with_message_count",
    "compression_format",
    "compression_mode",
    "relative_file_paths",
    "files",
    "custom_data",
    "ros_distro",
}
QOS = {
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "liveliness_lease_duration",
    "avoid_ros_namespace_conventions",
}


@pytest.fixture
def written(kit: SimpleNamespace, tmp_path: Path) -> Written:
    """A bag of all our message types, a latched topic and one first seen in flight, and what was written to it."""
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


def test_round_trip(written: Written) -> None:
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


def test_metadata_has_every_key_that_jazzy_demands(written: Written) -> None:
    path, log = written
    text = (path / "metadata.yaml").read_text()
    assert 'compression_format: ""\n' in text and 'compression_mode: ""\n' in text and 'outcome: ""\n' in text
    assert 'run_id: "17e5"\n' in text and "~" not in text and "null" not in text
    data = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert set(data) == REQUIRED
    assert (data["version"], data["storage_identifier"], data["ros_distro"]) == (9, "mcap", "jazzy")
    assert data["message_count"] == len(log)
    assert data["duration"] == {"nanoseconds": (STEPS - 1) * 10**7}
    assert data["starting_time"] == {"nanoseconds_since_epoch": 0}
    assert data["relative_file_paths"] == ["run_0.mcap"]
    (file,) = data["files"]
    assert set(file) == {"path", "starting_time", "duration", "message_count"} and file["message_count"] == len(log)
    endless = {"sec": 9223372036, "nsec": 854775807}
    for entry in data["topics_with_message_count"]:
        topic = entry["topic_metadata"]
        assert set(topic) == {
            "name",
            "type",
            "serialization_format",
            "offered_qos_profiles",
            "type_description_hash",
        }
        (profile,) = topic["offered_qos_profiles"]
        assert set(profile) == QOS
        assert profile["durability"] == ("transient_local" if topic["type"].endswith("/Ready") else "volatile")
        assert profile["deadline"] == profile["lifespan"] == profile["liveliness_lease_duration"] == endless
        assert topic["type_description_hash"].startswith("RIHS01_") and len(topic["type_description_hash"]) == 71


def test_the_file_itself_holds_the_metadata_for_reindexing(written: Written) -> None:
    path, _ = written
    with (path / "run_0.mcap").open("rb") as stream:
        (record,) = (r.metadata for r in make_reader(stream).iter_metadata() if r.name == "rosbag2")
    told = yaml.safe_load((path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert yaml.safe_load(record["serialized_metadata"]) == told


def test_custom_data_of_rosbag2_are_read(kit: SimpleNamespace, tmp_path: Path) -> None:
    told = {"custom_data": {"operator": "nobody"}, "ros_distro": "kilted"}
    path = tmp_path / "bag"
    path.mkdir()
    with (path / "bag_0.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        topic = kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")
        schema = writer.register_schema(topic.type, "ros2msg", topic.definition.encode())
        channel = writer.register_channel(topic.name, "cdr", schema, {})
        writer.add_message(channel, 7, kit.messages.stamped(topic.type, 0, 0), 7)
        writer.add_metadata("rosbag2", {"serialized_metadata": yaml.safe_dump(told)})
        writer.finish()
    bag = Bag(path)
    assert (bag.custom_data, bag.distro) == (told["custom_data"], "kilted")
    made = yaml.safe_load((recover(path).path / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert made["ros_distro"] == "kilted" and made["custom_data"] == {"operator": "nobody", "recovered": "true"}


@pytest.mark.parametrize("encoding", ["ros2msg", "ros2idl"])
def test_topics_of_others_that_cannot_be_decoded_are_left_alone(
    kit: SimpleNamespace, tmp_path: Path, encoding: str
) -> None:
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


def test_rosbags_reads_it_all(written: Written) -> None:
    path, log = written
    with Reader(path) as reader:
        assert reader.message_count == len(log)
        assert sorted((c.topic, time, bytes(data)) for c, time, data in reader.messages()) == sorted(log)
        qos = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
        assert qos["/hsv/any_ready"].durability == QosDurability.TRANSIENT_LOCAL
        assert qos["/hsv/any_vehiclestate"].reliability == QosReliability.RELIABLE


def test_mcap_ros2_decodes_it_alike(written: Written) -> None:
    path, log = written
    bag = Bag(path)
    with (path / "run_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert summary.statistics.message_count == len(log)
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 5
        # The first chunk holds all definitions besides its messages.
        assert max(index.uncompressed_size for index in summary.chunk_indexes[1:]) < 20_000
        for topic in ("/hsv/any_vehiclestate", "/hsv/any_nominalstate"):
            theirs = [message.decoded_message for message in reader.iter_decoded_messages([topic])]
            columns = bag.columns(topic)
            assert [message.step for message in theirs] == columns["step"].tolist()
            nested = topic == "/hsv/any_nominalstate"
            values = [message.deviation if nested else message for message in theirs]
            path_ = "deviation.elastic_rate_2" if nested else "elastic_rate_2"
            np.testing.assert_array_equal([value.elastic_rate_2 for value in values], columns[path_])


def test_bag_without_messages(kit: SimpleNamespace, tmp_path: Path) -> None:
    BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")]).close()
    data = yaml.safe_load((tmp_path / "bag/metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert data["starting_time"] == {"nanoseconds_since_epoch": 9223372036854775807}
    assert data["duration"] == {"nanoseconds": 0} and data["custom_data"] == {}
    bag = Bag(tmp_path / "bag")
    assert bag.complete and bag.topics["/hsv/state"].count == 0 and bag.span == (0, 0)
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 0


def test_qos_is_rendered_in_words() -> None:
    (profile,) = yaml.safe_load(Qos(deadline=1_500_000_000, lifespan=INFINITE).as_yaml())
    assert profile["deadline"] == {"sec": 1, "nsec": 500_000_000}
    assert set(profile) == QOS


def test_writer_refuses(kit: SimpleNamespace, tmp_path: Path) -> None:
    topic = kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")
    writer = BagWriter(tmp_path / "bag", [topic])
    for refused, word in [
        (lambda: BagWriter(tmp_path / "bag"), "exists already"),
        (lambda: writer.add_topic(topic), "/hsv/state"),
        (lambda: writer.write("/hsv/other", 0, b""), "/hsv/other"),
    ]:
        with pytest.raises(RecordingError, match=word):
            refused()


def test_full_disk_is_one_clear_line(kit: SimpleNamespace, tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    problem = r"bag_0\.mcap: cannot be written: File too large"
    with pytest.raises(RecordingError, match=problem), files_no_larger_than(10_000):
        for step in range(1000):
            writer.write("/hsv/state", step, kit.messages.random.bytes(200))


def _foreign(path: Path, kit: SimpleNamespace) -> Path:
    writer = BagWriter(path / "other", [kit.topic("/clock", "rosgraph_msgs/msg/Clock")])
    writer.write("/clock", 0, kit.messages.serialize(kit.messages.make("rosgraph_msgs/msg/Clock")))
    writer.close()
    return path / "other"


def _file(data: bytes) -> Callable[[Path, SimpleNamespace], Path]:
    def make(path: Path, kit: SimpleNamespace) -> Path:
        (path / "bag.mcap").write_bytes(data)
        return path / "bag.mcap"

    return make


def _cut(length: int) -> Callable[[Path, SimpleNamespace], Path]:
    def make(path: Path, kit: SimpleNamespace) -> Path:
        file = next(_foreign(path, kit).glob("*.mcap"))
        file.write_bytes(file.read_bytes()[:length])
        return file.parent

    return make


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda path, kit: path, "holds no file"),
        (lambda path, kit: path / "nowhere", "does not exist"),
        (_foreign, "no topic below /hsv/"),
        (_file(b""), "is empty"),
        (_file(b"SQLite format 3\0"), "not an MCAP"),
        (_cut(8), "truncated"),
        (_cut(20), "truncated"),
        (_cut(60), "truncated"),
    ],
    ids=["empty directory", "missing", "foreign", "empty file", "other format", "magic only", "header", "first chunk"],
)
def test_unusable_input_is_one_clear_line(
    make: Callable[[Path, SimpleNamespace], Path], word: str, kit: SimpleNamespace, tmp_path: Path
) -> None:
    path = make(tmp_path, kit)
    with pytest.raises(RecordingError, match=word) as error:
        Bag(path)
    assert "\n" not in str(error.value) and str(path) in str(error.value)


def test_missing_topic_and_damage_are_named(written: Written) -> None:
    path, log = written
    bag = Bag(path)
    for ask in (bag.columns, bag.messages, bag.times, bag.constants):
        with pytest.raises(RecordingError, match="no topic /hsv/nowhere, only /clock"):
            ask("/hsv/nowhere")
    file = path / "run_0.mcap"
    with file.open("rb") as stream:
        chunk = make_reader(stream).get_summary().chunk_indexes[3]  # type: ignore[union-attr]
    data = bytearray(file.read_bytes())
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 0xFF
    file.write_bytes(data)
    damaged = Bag(path)
    ((where, damage),) = damaged.loss.damages
    assert (where, damage.offset, damage.what) == (file, chunk.chunk_start_offset, "a chunk")
    found = sum(topic.count for topic in damaged.topics.values())
    assert damaged.complete and damaged.loss.counted
    assert 0 < damaged.loss.messages == len(log) - found < len(log) // 5


def test_message_that_does_not_fit_its_definition_is_named(kit: SimpleNamespace, tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag", [kit.topic("/hsv/state", "hsv_msgs/msg/VehicleState")])
    writer.write("/hsv/state", 5, b"\x00\x01\x00\x00" + bytes(4) + b"\x05" + bytes(15))
    writer.close()
    with pytest.raises(RecordingError, match="topic /hsv/state: message at 5 ns") as error:
        Bag(tmp_path / "bag").columns("/hsv/state")
    assert "\n" not in str(error.value)


def _record(data: bytes, opcode: Opcode) -> int:
    """Return where the first record of a kind begins."""
    position = 8
    while data[position] != opcode:
        position += 9 + struct.unpack_from("<Q", data, position + 1)[0]
    return position


def test_damage_outside_of_the_messages_is_named(written: Written) -> None:
    path, log = written
    file = path / "run_0.mcap"
    data = file.read_bytes()
    attached, chunk = _record(data, Opcode.ATTACHMENT), _record(data, Opcode.CHUNK)
    name = len("scenario.toml")
    length = attached + 9 + 16 + 4 + name + 4 + len("application/toml")
    places = {
        "an attachment's content": (data.index(b"duration = '4 s'"), b"f", attached, (0, 1)),
        "an attachment's length": (length, b"\xff" * 8, attached, (0, 1)),
        "a chunk's length": (chunk + 9 + 28 + 4 + len("zstd"), b"\xff" * 8, chunk, (None, 0)),
        "the kind of a chunk": (chunk, b"\x86", None, (None, 0)),
        "the beginning": (0, b"nothing", 0, (0, 0)),
    }
    for what, (position, wrong, offset, (messages, attachments)) in places.items():
        file.write_bytes(data[:position] + wrong + data[position + len(wrong) :])
        bag = Bag(file)
        assert [damage.offset for _, damage in bag.loss.damages] == [offset] * (offset is not None), what
        found = sum(topic.count for topic in bag.topics.values())
        assert bag.loss.messages == len(log) - found and bag.loss.attachments == attachments, what
        assert messages is None or bag.loss.messages == messages, what


def _two_channels(path: Path, kit: SimpleNamespace, kinds: tuple[str, str]) -> Path:
    """A bag whose topic has two channels."""
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


def test_two_channels_of_a_topic_are_one(kit: SimpleNamespace, tmp_path: Path) -> None:
    state, forces = "hsv_msgs/msg/VehicleState", "hsv_msgs/msg/VehicleForces"
    bag = Bag(_two_channels(tmp_path / "both.mcap", kit, (state, state)))
    assert bag.topics["/hsv/other"].count == 10
    assert bag.times("/hsv/other").tolist() == bag.columns("/hsv/other")["step"].tolist() == list(range(10))
    with pytest.raises(RecordingError, match="/hsv/other: recorded with two definitions"):
        Bag(_two_channels(tmp_path / "mixed.mcap", kit, (state, forces)))

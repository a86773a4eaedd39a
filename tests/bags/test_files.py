import os
import resource
import struct
import time
import tracemalloc
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from marking import long
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from hsv.bags.files import MAX_UNPACKED, find_files
from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError

REFERENCE = Path(__file__).parents[2] / "bags" / "reference" / "case1"


def files_of(folder, *names):
    for name in names:
        (folder / name).touch()
    found, missing = find_files(folder)
    return [path.name for path in found], missing


def test_files_of_a_split_bag_are_in_order_and_gaps_named(tmp_path):
    found = files_of(tmp_path, "run_10.mcap", "run_0.mcap", *(f"run_{n}.mcap" for n in range(2, 10)))
    assert found == (["run_0.mcap", *(f"run_{n}.mcap" for n in range(2, 11))], ["run_1.mcap"])


def test_a_number_that_is_a_date_is_no_place_in_a_sequence(tmp_path):
    assert files_of(tmp_path, "flight_20261122.mcap") == (["flight_20261122.mcap"], [])
    assert files_of(tmp_path, "flight_20261123.mcap") == (["flight_20261122.mcap", "flight_20261123.mcap"], [])


def record(opcode, body):
    return struct.pack("<BQ", opcode, len(body)) + body


def message(data):
    return record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, 0, 0, 0) + data)


def in_chunks(packed, name, contents):
    chunks = b""
    for content in contents:
        data = packed(content)
        head = struct.pack("<QQQII", 0, 0, len(content), 0, len(name)) + name
        chunks += record(Opcode.CHUNK, head + struct.pack("<Q", len(data)) + data)
    return MCAP0_MAGIC + chunks


@pytest.mark.parametrize(("name", "packed"), [("zstd", zstandard.compress), long("lz4", lz4.frame.compress)])
@pytest.mark.parametrize("inside", ["the file", "a chunk", "many chunks", "many messages"])
def test_what_unpacks_to_far_more_than_it_is_is_refused(tmp_path, name, packed, inside):
    zeros = bytes(2 * MAX_UNPACKED)
    part = zeros[: MAX_UNPACKED // 4]
    flown = (Path(__file__).parents[2] / "bags" / "reference" / "case1" / "case1_0.mcap").read_bytes()
    if inside == "the file":
        path, data = tmp_path / f"bag_0.mcap.{name}", packed(zeros)
    elif inside == "a chunk":
        path, data = tmp_path / "bag_0.mcap", in_chunks(packed, name.encode(), [zeros])
    elif inside == "many chunks":
        contents = [message(part + bytes([number])) for number in range(5)]
        path, data = tmp_path / "bag_0.mcap", in_chunks(packed, name.encode(), contents)
    else:
        messages = b"".join(message(packed(part)) for _ in range(5))
        path, data = tmp_path / "bag_0.mcap", flown[:8] + messages + flown[8:]
    path.write_bytes(data)
    del zeros, part
    tracemalloc.start()
    with pytest.raises(
        RecordingError, match=r"bag_0\.mcap\S*: unpacks to more than \d+ bytes, expected at most 134217728"
    ):
        Bag(tmp_path)
    assert tracemalloc.get_traced_memory()[1] < 3 * MAX_UNPACKED
    tracemalloc.stop()


def test_a_hole_behind_the_records_is_refused_in_bounded_memory_and_work(tmp_path):
    recorded = (REFERENCE / "case1_0.mcap").read_bytes()
    (tmp_path / "case1_0.mcap").write_bytes(recorded[:100_000])
    os.truncate(tmp_path / "case1_0.mcap", 3 * 2**30)
    begun, before = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(RecordingError, match=r"case1_0.mcap: no record in the 67108864 bytes from byte \d+ on$"):
        Bag(tmp_path)
    assert time.process_time() - begun < 5.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000

"""The files of a bag: which they are, in which order, and what is in them, decompressed where rosbag2 compressed."""

from __future__ import annotations

import fcntl
import re
from pathlib import Path
from typing import IO

import lz4.frame
import zstandard

from hsv.bags.metadata import file_names, read_metadata
from hsv.base.errors import DocumentError, RecordingError
from hsv.base.files import read_bytes

COMPRESSIONS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
"""Beginning of compressed data; neither an MCAP file nor a message in CDR begins like this."""
_MAGIC = 4
_NAME = re.compile(r".+\.mcap(?:\.zstd|\.zst|\.lz4)?")
_NUMBER = re.compile(r"_(\d+)\.mcap")
_MOST_FILES = 100_000
"""Number from which on that of a file is none of a sequence."""
_PART = 4096
"""Bytes that are decompressed at a time: what lies before a damage is not lost with it."""


def locked(stream: IO[bytes], *, shared: bool = False) -> bool:
    """Lock an open file until it is closed; tell whether that was possible, which it is not while it is recorded.

    A file system without locks gives one to everybody. ``shared``: others may have such a lock at the same time.
    """
    try:
        fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def being_recorded(path: Path) -> bool:
    """Tell whether a recorder is writing the file."""
    with path.open("rb") as stream:
        return not locked(stream, shared=True)


def find_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the files of a bag in their order, and the names of those that it should have but has not.

    Args:
        path: A bag directory, or one of its files.

    Raises:
        RecordingError: There is none, or no telling which belong together.
    """
    if path.suffix == ".db3" or (path.is_dir() and any(path.glob("*.db3"))):
        raise RecordingError(
            f"{path}: recorded with sqlite3, expected MCAP: ros2 bag convert -i {path} -o mcap.yaml makes it, and "
            "docs/replay.md has that file"
        )
    if path.is_file():
        return [path], []
    if not path.is_dir():
        raise RecordingError(f"{path}: does not exist, expected a bag directory or an MCAP file")
    there = {file.name for file in path.iterdir() if file.is_file() and _NAME.fullmatch(file.name)}
    # Of a recorder that was killed while it compressed a file, the file itself is the whole one.
    there -= {name for name in there if not name.endswith(".mcap") and name.rpartition(".")[0] in there}
    # Old versions of rosbag2 wrote the directory as well.
    listed = [name for name in (Path(name).name for name in file_names(read_metadata(path))) if _NAME.fullmatch(name)]
    if known := {_stem(name) for name in listed if name in there}:
        there = {name for name in there if _stem(name) in known}
    stems = {_stem(name) for name in there}
    if len(stems) != 1:
        found = f"files *.mcap of {len(stems)} bags" if stems else "no file *.mcap"
        raise RecordingError(f"{path}: holds {found}, expected a bag directory")
    numbered = {_number(name): name for name in there}
    # A single file that nothing else tells of is the bag, and what is numbered by dates has no gaps: rosbag2 counts.
    counted = len(numbered) > 1 and max(numbered) < _MOST_FILES
    gaps = {number: f"{stems.copy().pop()}_{number}.mcap" for number in range(max(numbered) if counted else 0)}
    expected = gaps | ({_number(name): name for name in listed} if known else {})
    missing = [expected[number] for number in sorted(expected.keys() - numbered.keys())]
    return [path / numbered[number] for number in sorted(numbered)], missing


def _stem(name: str) -> str:
    return _NUMBER.sub(".mcap", name).partition(".mcap")[0]


def _number(name: str) -> int:
    match = _NUMBER.search(name)
    return int(match[1]) if match else 0


def read_file(path: Path) -> bytes:
    """Return the contents of a file of a bag, as far as it can be decompressed.

    Raises:
        RecordingError: It cannot be read.
    """
    try:
        return decompressed(read_bytes(path))[0]
    except DocumentError as error:
        raise RecordingError(f"{path}: {error}") from None


def read_message(data: bytes) -> bytes | None:
    """Return a message as it was before rosbag2 compressed it, if it did; None if it is damaged."""
    content, whole = decompressed(data)
    return content if whole else None


def decompressed(data: bytes) -> tuple[bytes, bool]:
    """Return the content of data that may be compressed, up to the first damage, and whether that is all of it."""
    match COMPRESSIONS.get(data[:_MAGIC]):
        case "zstd":
            stream = zstandard.ZstdDecompressor().decompressobj()
        case "lz4":
            stream = lz4.frame.LZ4FrameDecompressor()
        case _:
            return data, True
    parts = []
    for start in range(0, len(data), _PART):
        try:
            parts.append(stream.decompress(data[start : start + _PART]))
        except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):
            return b"".join(parts), False
    return b"".join(parts), bool(stream.eof)

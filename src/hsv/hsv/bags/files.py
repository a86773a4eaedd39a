"""The files of a bag: their names, their order, and their contents, decompressed if rosbag2 compressed them."""

from __future__ import annotations

import fcntl
import mmap
import os
import re
from pathlib import Path
from typing import IO

import lz4.frame
import zstandard

from hsv.bags.metadata import file_names, read_metadata
from hsv.base.errors import DocumentError, RecordingError, reason
from hsv.base.files import open_regular

COMPRESSIONS = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}
"""Names of compressions by the first bytes of compressed data; MCAP files and messages in CDR begin differently."""
_MAGIC = 4
_NAME = re.compile(r".+\.mcap(?:\.zstd|\.zst|\.lz4)?")
_NUMBER = re.compile(r"_(\d+)\.mcap")
_MAX_FILES = 100_000
"""A number of this size or more in a file name is a date or the like, not the counter of a split bag."""
_PART = 1024
"""Number of compressed bytes (at most 32 MiB unpacked) to unpack at a time, so that data before a damage are kept."""

MAX_UNPACKED, MAX_RATIO = 2**27, 32
"""Limits on the size of an unpacked file: bytes, or a multiple of the packed size if that is more. A flight is
compressed to about a quarter."""


def locked(stream: IO[bytes], *, shared: bool = False) -> bool:
    """Try once to lock an open file; return whether this succeeded. The lock lasts until the file is closed.

    A recorder holds the exclusive lock of its file. Several processes can hold a ``shared`` one. On a file system
    without locks every attempt succeeds.
    """
    try:
        fcntl.flock(stream, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def being_recorded(path: Path) -> bool:
    """Return whether a recorder or a recovery holds the exclusive lock of the file, see :func:`locked`."""
    with path.open("rb") as stream:
        return not locked(stream, shared=True)


def find_files(path: Path) -> tuple[list[Path], list[str]]:
    """Return the files of a bag in their order, and the names of its missing files.

    Args:
        path: A bag directory, or one of its files, which is then returned alone.

    Raises:
        RecordingError: There is no MCAP file, the bag is in sqlite3, or the directory contains files of several bags
            and its metadata.yaml does not tell which to read.
    """
    if path.suffix == ".db3" or (path.is_dir() and any(path.glob("*.db3"))):
        raise RecordingError(
            f"{path}: recorded with sqlite3, expected MCAP: ros2 bag convert -i {path} -o mcap.yaml makes it, and "
            "docs/replay.md has that file"
        )
    if path.suffix == ".parquet":
        raise RecordingError(f"{path}: the results of a campaign, expected a bag (hsv montecarlo summary {path})")
    if path.is_file():
        return [path], []
    if not path.is_dir():
        raise RecordingError(f"{path}: does not exist, expected a bag directory or an MCAP file")
    there = {file.name for file in path.iterdir() if file.is_file() and _NAME.fullmatch(file.name)}
    # A recorder killed while it compressed a file leaves an incomplete compressed file next to the original.
    there -= {name for name in there if not name.endswith(".mcap") and name.rpartition(".")[0] in there}
    # Old versions of rosbag2 wrote paths with the directory.
    listed = [name for name in (Path(name).name for name in file_names(read_metadata(path))) if _NAME.fullmatch(name)]
    if known := {_stem(name) for name in listed if name in there}:
        there = {name for name in there if _stem(name) in known}
    stems = {_stem(name) for name in there}
    if len(stems) != 1:
        found = f"files *.mcap of {len(stems)} bags" if stems else "no file *.mcap"
        raise RecordingError(f"{path}: holds {found}, expected a bag directory")
    numbered = {_number(name): name for name in there}
    # Gaps are known only for files with counters, and not for a single file that the metadata do not list.
    counted = len(numbered) > 1 and max(numbered) < _MAX_FILES
    gaps = {number: f"{stems.copy().pop()}_{number}.mcap" for number in range(max(numbered) if counted else 0)}
    expected = gaps | ({_number(name): name for name in listed} if known else {})
    missing = [expected[number] for number in sorted(expected.keys() - numbered.keys())]
    return [path / numbered[number] for number in sorted(numbered)], missing


def _stem(name: str) -> str:
    return _NUMBER.sub(".mcap", name).partition(".mcap")[0]


def _number(name: str) -> int:
    match = _NUMBER.search(name)
    return int(match[1]) if match else 0


class Unpacker:
    """A file of a bag, whose contents rosbag2 may have compressed: as a whole, in chunks, or message by message.

    The total size of the unpacked data is limited, because a few compressed bytes can stand for gigabytes.

    Raises:
        RecordingError: The file cannot be read, or it unpacks to more than :data:`MAX_UNPACKED` bytes and also
            to more than :data:`MAX_RATIO` times its size.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with open_regular(path) as stream:
                # Mapped, because a file may be larger than the memory, and mostly a hole.
                size = os.fstat(stream.fileno()).st_size
                data = mmap.mmap(stream.fileno(), size, access=mmap.ACCESS_READ) if size else b""
        except DocumentError as error:
            raise RecordingError(f"{path}: {error}") from None
        except OSError as error:
            raise RecordingError(f"{path}: cannot be read ({reason(error)})") from None
        self._packed = self._unpacked = 0
        self.data = self.unpacked(data)[0]
        """Contents of the file, as far as it can be unpacked."""

    def unpacked(self, data: bytes | mmap.mmap, compression: str | None = None) -> tuple[bytes | mmap.mmap, bool]:
        """Return ``data``, decompressed up to the first damage, and whether they were decompressed completely.

        ``compression`` is ``zstd``, ``lz4``, or empty (not compressed); None: identified by the first bytes.
        """
        match COMPRESSIONS.get(data[:_MAGIC], "") if compression is None else compression:
            case "zstd":
                stream = zstandard.ZstdDecompressor().decompressobj()
            case "lz4":
                stream = lz4.frame.LZ4FrameDecompressor()
            case _:
                return data, True
        parts, whole = [], True
        for start in range(0, len(data), _PART):
            try:
                parts.append(stream.decompress(data[start : start + _PART]))
            except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError):
                whole = False
                break
            self._packed += len(data[start : start + _PART])
            self._unpacked += len(parts[-1])
            if self._unpacked > (limit := max(MAX_UNPACKED, MAX_RATIO * self._packed)):
                raise RecordingError(
                    f"{self.path}: unpacks to more than {limit} bytes, expected at most {MAX_UNPACKED} or "
                    f"{MAX_RATIO} times its size"
                )
        return b"".join(parts), whole and bool(stream.eof)

    def message(self, data: bytes) -> bytes | None:
        """Return a message, decompressed if rosbag2 compressed it; None if it is damaged."""
        content, whole = self.unpacked(data)
        return bytes(content) if whole else None

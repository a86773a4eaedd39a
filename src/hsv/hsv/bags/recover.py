"""Recovery of truncated or damaged bags, as left by a killed writer or a damaged disk."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from hsv.bags.files import find_files, locked
from hsv.bags.metadata import FILE_NAME, file_names, message_counts, read_metadata
from hsv.bags.reader import Bag
from hsv.bags.writer import BagWriter
from hsv.base.errors import RecordingError

RECOVERED = {"recovered": "true"}
"""Custom data that mark a recovered bag, whose end may not be the end of the run."""


@dataclass(frozen=True, slots=True)
class Recovery:
    """Result of a recovery of ``bag``; ``path`` is the directory of the new bag, or of ``bag`` if it needed none."""

    bag: Bag
    path: Path
    messages: int
    changed: bool


def recover(path: Path | str, target: Path | None = None) -> Recovery:
    """Write a new bag with all intact data of a truncated or damaged bag; the original is not modified.

    The new bag has one file with summary and indexes, and metadata.yaml. An intact bag that has it is not copied.

    Args:
        path: A bag directory, or a file in it to recover alone.
        target: The new bag directory; default: the original's name with ``_recovered``, next to the original.

    Raises:
        RecordingError: The recorder of the bag still runs, nothing of the bag can be read (see
            :class:`hsv.bags.reader.Bag`), the target exists, or it cannot be written.
    """
    with _exclusively(find_files(Path(path))[0]):
        bag = Bag(path)
        messages = sum(topic.count for topic in (*bag.topics.values(), *bag.undecodable.values()))
        if bag.complete and not bag.loss and _has_its_metadata(bag, messages):
            return Recovery(bag, bag.folder, messages, changed=False)
        folder = bag.folder.absolute()
        target = (target or folder.with_name(f"{folder.name}_recovered")).absolute()
        if target.exists():
            raise RecordingError(f"out = {str(target)!r}: exists already, expected a new bag directory")
        try:
            _copy(bag, target)
        except BaseException:
            shutil.rmtree(target, ignore_errors=True)
            raise
    return Recovery(bag, target, messages, changed=True)


def finalise(directory: Path) -> None:
    """Complete the bag of a killed recorder in place.

    The new file replaces the old one only when it is complete, so that an interrupted call loses no data.

    Raises:
        RecordingError: The recorder of the bag still runs, nothing of the bag can be read, the bag is damaged, or there
            is no space left.
    """
    with _exclusively(find_files(directory)[0]):
        bag = Bag(directory)
        if bag.loss:
            raise RecordingError(f"{bag.path}: is damaged, hsv recover makes a new bag of what is whole")
        (mcap,) = bag.files
        try:
            with TemporaryDirectory(dir=directory) as part:
                made = Path(part, directory.name)
                _copy(bag, made).replace(mcap)
                (made / FILE_NAME).replace(directory / FILE_NAME)
        except (OSError, RecordingError) as error:
            refused = error if isinstance(error, OSError) else error.__cause__
            if not isinstance(refused, OSError):
                raise
            raise RecordingError(f"{mcap}: cannot be repaired: {refused.strerror}") from None


def _has_its_metadata(bag: Bag, messages: int) -> bool:
    values = read_metadata(bag.folder)
    names = [file.name for file in bag.files]
    counts = message_counts(values)
    return (
        [name for name in file_names(values) if Path(name).name in names] != []
        and values.get("storage_identifier") == "mcap"
        and sum(counts.get(name, 0) for name in names) == messages
    )


@contextmanager
def _exclusively(files: list[Path]) -> Iterator[None]:
    """Lock ``files`` during the context; a RecordingError says that one is being recorded or cannot be opened."""
    with ExitStack() as stack:
        for file in files:
            try:
                stream = stack.enter_context(file.open("rb"))
            except OSError as error:
                raise RecordingError(f"{file}: cannot be read: {error.strerror}") from None
            if not locked(stream):
                raise RecordingError(f"{file}: is being recorded, expected a bag whose recorder has ended")
        yield


def _copy(bag: Bag, target: Path) -> Path:
    """Write the intact data of ``bag`` to a new bag that is marked as recovered; return the new file."""
    topics = (*bag.topics.values(), *bag.undecodable.values())
    writer = BagWriter(target, topics, bag.custom_data | RECOVERED, bag.distro)
    for name, data in bag.attachments.items():
        writer.attach(name, bag.media_types[name], data)
    for topic, message in bag.recorded():
        writer.write(topic, message.log_time, message.data, message.publish_time)
    writer.close()
    return writer.path

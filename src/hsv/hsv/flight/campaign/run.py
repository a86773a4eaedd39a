"""The engine of campaigns: it flies the missing batches and stores their results."""

from __future__ import annotations

import fcntl
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple, Protocol

from hsv.base.errors import CampaignError, reason
from hsv.flight.campaign.executors import Executor, Job


class Batch(NamedTuple):
    """A number of flights that are flown and stored together; its number is its place in the campaign."""

    label: str
    """Name in messages"""
    flights: int


class Plan(Protocol):
    """The definition of a campaign."""

    @property
    def text(self) -> str:
        """The campaign as a text, from which workers read it."""

    @property
    def batches(self) -> Sequence[Batch]:
        """All batches."""


class Store(ABC):
    """The place where the results of a campaign are kept, and the job that makes them."""

    def __init__(self, place: Path, lock: Path, fly: Job) -> None:
        """Keep the results of the job ``fly`` in a file or folder ``place``, with the file ``lock`` next to it."""
        self._place, self._lock = place, lock
        self.fly = fly

    @contextmanager
    def opened(self, *, restart: bool = False) -> Iterator[set[int]]:
        """Yield the numbers of the finished batches; with ``restart``, existing results are discarded before.

        Raises:
            CampaignError: The place belongs to another campaign, cannot be made, or is in use.
        """
        with writing(self._place):
            self._lock.parent.mkdir(parents=True, exist_ok=True)
        with locked(self._lock, f"{self._place}: in use, another process is flying this campaign"):
            yield self.finished(restart)

    @abstractmethod
    def finished(self, restart: bool) -> set[int]:
        """Return the numbers of the finished batches; errors as for :meth:`opened`."""

    @abstractmethod
    def path(self, batch: int) -> Path:
        """Return the file of a batch."""

    def keep(self, batch: int, content: bytes) -> None:
        """Store the result of a batch atomically."""
        write_whole(self.path(batch), content)

    def finish(self) -> None:  # noqa: B027
        """Complete the results once all batches are there."""


class Flown(NamedTuple):
    """The flights and batches that a run has flown, and the time (s) that it took."""

    flights: int
    batches: int
    wall_time: float


def run_campaign(
    plan: Plan,
    store: Store,
    executor: Executor,
    *,
    restart: bool = False,
    progress: Callable[[int], None] = lambda flights: None,
) -> Flown:
    """Fly those batches of a campaign whose results are not in the store, or with ``restart`` all of them.

    ``progress`` is called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError: The store holds another campaign, is in use, or cannot be written.
        RunError: A batch ends its worker process, or the scheduler is lost.
    """
    with store.opened(restart=restart) as finished:
        batches = plan.batches
        missing = [number for number in range(len(batches)) if number not in finished]
        found = done = sum(batches[number].flights for number in finished)
        progress(done)
        started = time.perf_counter()
        for number, content in executor.fly(store.fly, plan.text, missing, lambda number: batches[number].label):
            store.keep(number, content)
            done += batches[number].flights
            progress(done)
        store.finish()
        return Flown(done - found, len(missing), time.perf_counter() - started)


@contextmanager
def locked(path: Path, complaint: str) -> Iterator[None]:
    """Hold the lock file ``path``, which exists only while it is held, or if its holder was killed.

    If another process holds it, the ``CampaignError`` is the ``complaint``.
    """
    while True:
        try:
            stream = path.open("w")
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CampaignError(complaint) from None
        except OSError as error:
            raise CampaignError(f"{path}: cannot be locked ({reason(error)})") from error
        with stream:
            # The last holder may have removed the file in the meantime, and a third process made another one.
            if not path.exists() or not os.path.samestat(path.stat(), os.fstat(stream.fileno())):
                continue
            try:
                yield
                return
            finally:
                path.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically."""
    temporary = path.with_name(path.name + ".unfinished")
    with writing(path, temporary):
        temporary.write_bytes(content)
        replace_file(temporary, path)


@contextmanager
def writing(path: Path, temporary: Path | None = None) -> Iterator[None]:
    """Convert system errors to an error that names ``path``, and remove an incomplete ``temporary`` file."""
    try:
        yield
    except OSError as error:
        if temporary:
            temporary.unlink(missing_ok=True)
        kept = "; finished batches are kept" if temporary else ""
        raise CampaignError(f"{path}: cannot be written ({reason(error)}){kept}") from error


def replace_file(temporary: Path, path: Path) -> None:
    """Move a finished file into place, on the disk before it has its name."""
    with temporary.open("rb") as stream:
        os.fsync(stream.fileno())
    temporary.replace(path)

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
    """A group of flights that are flown and stored together; its number is its index in :attr:`Plan.batches`."""

    label: str
    """Name of the batch in messages"""
    flights: int
    """Number of flights"""


class Plan(Protocol):
    """The definition of a campaign, as far as :func:`run_campaign` uses it."""

    @property
    def text(self) -> str:
        """The campaign as a text, from which worker processes construct it."""

    @property
    def batches(self) -> Sequence[Batch]:
        """All batches, in the order of their numbers."""


class Store(ABC):
    """Storage for the results of a campaign, with the job that computes them."""

    def __init__(self, place: Path, lock: Path, fly: Job) -> None:
        """Store the results of the job ``fly`` in a file or folder ``place``; ``lock`` is the path of the lock file."""
        self._place, self._lock = place, lock
        self.fly = fly

    @contextmanager
    def opened(self, *, restart: bool = False) -> Iterator[set[int]]:
        """Lock the store and yield the numbers of the finished batches; with ``restart``, old results count as missing.

        Raises:
            CampaignError: The store belongs to another campaign, cannot be created, or is in use.
        """
        with writing(self._place):
            self._lock.parent.mkdir(parents=True, exist_ok=True)
        with locked(self._lock, f"{self._place}: in use, another process is flying this campaign"):
            yield self.finished(restart)

    @abstractmethod
    def finished(self, restart: bool) -> set[int]:
        """Return the numbers of the finished batches, none with ``restart``; errors as for :meth:`opened`."""

    @abstractmethod
    def path(self, batch: int) -> Path:
        """Return the path of the result file of a batch."""

    def keep(self, batch: int, content: bytes) -> None:
        """Store the result of a batch atomically."""
        write_whole(self.path(batch), content)

    def finish(self) -> None:  # noqa: B027
        """Complete the results after the last batch; by default, there is nothing to do."""


class Flown(NamedTuple):
    """The numbers of flights and batches flown by one call of :func:`run_campaign`, and its wall time (s)."""

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

    ``progress`` is called with the number of finished flights, including those that were in the store before.

    Raises:
        CampaignError: The store holds another campaign, is in use or damaged, or cannot be written.
        RunError: A batch crashes a worker, a worker cannot start or has another version, or the scheduler is lost.
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
    """Hold an exclusive lock on the file ``path``, which is created for this purpose and removed afterwards.

    Raises:
        CampaignError: Another process holds the lock, with the message ``complaint``, or the file cannot be created.
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
            # The previous holder may have removed the file after it was opened here, and then the lock is void.
            if not path.exists() or not os.path.samestat(path.stat(), os.fstat(stream.fileno())):
                continue
            try:
                yield
                return
            finally:
                path.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically; a ``CampaignError`` if this fails."""
    temporary = path.with_name(path.name + ".unfinished")
    with writing(path, temporary):
        temporary.write_bytes(content)
        replace_file(temporary, path)


@contextmanager
def writing(path: Path, temporary: Path | None = None) -> Iterator[None]:
    """Turn an ``OSError`` of this context into a ``CampaignError`` that names ``path``; then remove ``temporary``."""
    try:
        yield
    except OSError as error:
        if temporary:
            temporary.unlink(missing_ok=True)
        kept = "; finished batches are kept" if temporary else ""
        raise CampaignError(f"{path}: cannot be written ({reason(error)}){kept}") from error


def replace_file(temporary: Path, path: Path) -> None:
    """Rename a finished file ``temporary`` to ``path`` after its content has reached the disk."""
    with temporary.open("rb") as stream:
        os.fsync(stream.fileno())
    temporary.replace(path)

"""The engine of campaigns: it flies the missing batches, stores their results, and estimates the remaining time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

from hsv.flight.campaign.executors import Executor, Job


class Batch(Protocol):
    """A number of flights that are flown and stored together."""

    @property
    def label(self) -> str:
        """Name in messages."""

    @property
    def flights(self) -> int:
        """Number of flights."""

    @property
    def kind(self) -> int:
        """Number of the kind of flights; those of one kind take about the same time."""


class Plan(Protocol):
    """The definition of a campaign."""

    @property
    def text(self) -> str:
        """The campaign as a text, from which workers read it."""

    @property
    def batches(self) -> Sequence[Batch]:
        """All batches; a batch is called by its place in the list."""


class Store(Protocol):
    """The place where the results of a campaign are kept, and the jobs that make them."""

    @property
    def fly(self) -> Job:
        """The job that flies a batch."""

    @property
    def time(self) -> Job:
        """The job that returns how long (s, as a text) a flight takes, by the number of its kind."""

    def opened(self, *, restart: bool = False) -> AbstractContextManager[set[int]]:
        """Lock the place, and yield the numbers of the finished batches."""

    def keep(self, batch: int, content: bytes) -> None:
        """Store the result of a batch."""

    def finish(self) -> None:
        """Complete the results once all batches are there."""

    def space(self, flights: int, batches: int) -> int:
        """Return the disk space (bytes) that the results of so many batches take."""


@dataclass(frozen=True)
class Capacity:
    """The flights that are still to be flown, and their cost: wall time (s) on ``cores``, and bytes on the disk."""

    flights: int
    cores: int
    wall_time: float
    bytes: int


@dataclass(frozen=True)
class Flown:
    """The flights and batches that a run has flown, the time (s) that it took, and the expected time."""

    flights: int = 0
    batches: int = 0
    wall_time: float = 0.0
    expected: float = 0.0


def run_campaign(
    plan: Plan,
    store: Store,
    executor: Executor,
    *,
    restart: bool = False,
    expect: Callable[[Capacity], None] = lambda capacity: None,
    progress: Callable[[int], None] = lambda flights: None,
) -> Flown:
    """Fly the missing flights of a campaign.

    Args:
        plan: The campaign.
        store: Keeps the results; batches that are there already are not flown again.
        executor: Flies the batches.
        restart: Whether to discard existing results first.
        expect: Called once, before the first batch, with the capacity that the run needs.
        progress: Called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError: The store holds another campaign, is in use, or cannot be written.
        RunError: A batch ends its worker process, or the scheduler is lost.
    """
    with store.opened(restart=restart) as finished:
        batches = plan.batches
        missing = [number for number in range(len(batches)) if number not in finished]
        done = sum(batches[number].flights for number in finished)
        needed = Capacity(0, executor.cores, 0.0, 0)
        if missing:
            needed = capacity(plan, store, executor, missing)
            expect(needed)
        progress(done)
        started = time.perf_counter()
        for number, content in executor.fly(store.fly, plan.text, missing, lambda number: batches[number].label):
            store.keep(number, content)
            done += batches[number].flights
            progress(done)
        store.finish()
        return Flown(needed.flights, len(missing), time.perf_counter() - started, needed.wall_time)


def capacity(plan: Plan, store: Store, executor: Executor, missing: Sequence[int]) -> Capacity:
    """Return the capacity that the ``missing`` batches need, from flights that are timed on all cores at once."""
    cores, left = max(executor.cores, 1), [plan.batches[number] for number in missing]
    kinds = sorted({batch.kind for batch in left})
    spent: dict[int, list[float]] = {kind: [] for kind in kinds}
    # All cores fly: what they take from each other, and other work from them, is in the measurement.
    timed = [kinds[index % len(kinds)] for index in range(max(cores, len(kinds)))]
    for kind, content in executor.fly(store.time, plan.text, timed):
        spent[kind].append(float(content))
    seconds = {kind: sum(times) / len(times) for kind, times in spent.items()}
    wall_time = sum(batch.flights * seconds[batch.kind] for batch in left) / cores
    longest = max(batch.flights * seconds[batch.kind] for batch in left)
    flights = sum(batch.flights for batch in left)
    return Capacity(flights, cores, max(wall_time, longest), store.space(flights, len(left)))

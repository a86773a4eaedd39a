"""Expected duration of a campaign, estimated from test flights of its own executor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hsv.flight.campaign.executors import Executor, Job


@dataclass(frozen=True)
class Capacity:
    """The flights that are still to be flown, and their cost: wall time (s) on ``cores``, and bytes on the disk."""

    flights: int
    cores: int
    wall_time: float
    bytes: int


def timed(executor: Executor, job: Job, text: str, numbers: Sequence[int]) -> dict[int, float]:
    """Return how long (s) the ``executor`` takes for each of ``numbers`` of the campaign in ``text``, as ``job`` says.

    All of its cores fly at the same time: what they take from each other, and other work from them, is in it.
    """
    return {number: float(seconds) for number, seconds in executor.fly(job, text, numbers)}


def evenly(numbers: Sequence[int], count: int) -> list[int]:
    """Return at most ``count`` of ``numbers``, from all over them."""
    count = min(count, len(numbers))
    return [numbers[index * len(numbers) // count] for index in range(count)]

"""Several flights in vector registers: a number type for compiled functions whose value is one number a lane.

A function that is written for numbers and arrays is compiled for :class:`LaneArray` as well, and then computes what it
computes for one flight for several of them. Each lane has the bits that it would have alone: additions,
multiplications, divisions and roots are rounded lane by lane, and nothing is reordered. What depends on a comparison is
written with :func:`choose`, :func:`every`, :func:`least` and :func:`most`, which of a single number are what they say;
an ``if`` does not take a comparison of lanes.

What these functions are of lanes is in :mod:`hsv.lane_overloads`, and the type itself, with the numbers that a register
of this processor holds and the lanes, twice as many, in :mod:`hsv.lane_types`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.lane_arrays import BLOCK, LaneArray, LaneRecord

__all__ = [
    "BLOCK",
    "LaneArray",
    "LaneRecord",
    "choose",
    "every",
    "lane",
    "lanes_in",
    "least",
    "most",
    "power_of_two",
    "weighted_sum",
    "with_lane",
]


def every(condition: Any) -> Any:
    """Tell whether ``condition`` holds, in all lanes if it is one of lanes."""
    return condition


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return ``a`` where ``condition`` holds, ``b`` elsewhere; both are computed."""
    return a if condition else b


def lanes_in(value: Any) -> int:
    """Return how many lanes a value or the elements of an array have, 1 of numbers."""
    return 1


def lane(value: Any, index: int) -> Any:
    """Return what ``value``, a number or a condition, is in a lane."""
    return value


def least(value: Any) -> Any:
    """Return ``value``, or the least of its lanes, which are all numbers."""
    return value


def most(value: Any) -> Any:
    """Return ``value``, or the largest of its lanes, which are all numbers."""
    return value


def with_lane(value: Any, index: int, number: float) -> Any:
    """Return ``value`` with another ``number`` in a lane."""
    return number


def weighted_sum(weights: Any, rows: Any, total: Any) -> None:
    """Write into ``total`` (e) the sum of the ``rows`` (r, e) by their ``weights`` (r), added in their order.

    ``rows`` are contiguous, and e is a multiple of :data:`BLOCK`: of numbers as many neighbours as a register
    holds are computed at once.
    """
    for e in range(rows.shape[1]):
        total[e] = 0.0
        for r in range(len(rows)):
            total[e] += weights[r] * rows[r, e]


@njit_in_flight()
def power_of_two_of_number(whole: float) -> float:
    return np.int64((int(whole) + 1023) << 52).view(np.float64)


def power_of_two(whole: Any) -> Any:
    """Return 2^``whole`` for whole numbers from -1022 to 1023, by the bits of a normal number."""
    return power_of_two_of_number(whole)

"""Several flights in one vector register: a number type for compiled functions whose value is one number a lane.

A function that is written for numbers and arrays is compiled for :class:`LaneArray` as well, and then computes what it
computes for one flight for :data:`WIDTH` of them. Each lane has the bits that it would have alone: additions,
multiplications, divisions and roots are rounded lane by lane, and nothing is reordered. What depends on a comparison is
written with :func:`choose`, :func:`every`, :func:`least` and :func:`most`, which of a single number are what they say;
an ``if`` does not take a comparison of lanes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload

from hsv.compiled import njit_in_flight
from hsv.lane_types import (
    WIDTH,
    LaneArray,
    LaneArrayType,
    LaneRecord,
    LanesType,
    MaskType,
    all_of,
    lane_numbers,
    neighbours,
    one_lane,
    powers_of_two,
    select,
    write_neighbours,
)
from hsv.lane_types import with_lane as inserted

__all__ = [
    "WIDTH",
    "LaneArray",
    "LaneRecord",
    "choose",
    "every",
    "lane",
    "lane_numbers",
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


@overload(every, strict=False)
def _every(condition: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition: all_of(condition)
    return lambda condition: condition


def choose(condition: Any, a: Any, b: Any) -> Any:
    """Return ``a`` where ``condition`` holds, ``b`` elsewhere; both are computed."""
    return a if condition else b


@overload(choose, strict=False)
def _choose(condition: Any, a: Any, b: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition, a, b: select(condition, a, b)
    return lambda condition, a, b: a if condition else b


def lanes_in(value: Any) -> int:
    """Return how many lanes a value or the elements of an array have, 1 of numbers."""
    return 1


@overload(lanes_in, strict=False)
def _lanes_in(value: Any) -> Any:
    count = value.count if isinstance(value, LanesType | LaneArrayType) else 1
    return lambda value: count


def lane(value: Any, index: int) -> Any:
    """Return what ``value``, a number or a condition, is in a lane."""
    return value


@overload(lane, strict=False)
def _lane_of(value: Any, index: Any) -> Any:
    if isinstance(value, LanesType | MaskType):
        return lambda value, index: one_lane(value, index)
    return None if isinstance(value, LaneArrayType) else lambda value, index: value


def least(value: Any) -> Any:
    """Return ``value``, or the least of its lanes, which are all numbers."""
    return value


def most(value: Any) -> Any:
    """Return ``value``, or the largest of its lanes, which are all numbers."""
    return value


def _extreme(pick: Callable[..., Any]) -> Callable[..., Any]:
    def implemented(value: Any) -> Any:
        if not isinstance(value, LanesType):
            return lambda value: value
        count = value.count

        def found(value: Any) -> Any:
            extreme = one_lane(value, 0)
            for i in range(1, count):
                extreme = pick(extreme, one_lane(value, i))
            return extreme

        return found

    return implemented


overload(least, strict=False)(_extreme(min))
overload(most, strict=False)(_extreme(max))


def with_lane(value: Any, index: int, number: float) -> Any:
    """Return ``value`` with another ``number`` in a lane."""
    return number


@overload(with_lane, strict=False)
def _with(value: Any, index: Any, number: Any) -> Any:
    if isinstance(value, LanesType):
        return lambda value, index, number: inserted(value, index, number)
    return lambda value, index, number: number


def weighted_sum(weights: Any, rows: Any, total: Any) -> None:
    """Write into ``total`` (e) the sum of the ``rows`` (r, e) by their ``weights`` (r), added in their order.

    ``rows`` are contiguous, and e is a multiple of :data:`WIDTH`: of numbers as many neighbours are computed at once.
    """
    for e in range(rows.shape[1]):
        total[e] = 0.0
        for r in range(len(rows)):
            total[e] += weights[r] * rows[r, e]


@overload(weighted_sum)
def _weighted_sum(weights: Any, rows: Any, total: Any) -> Any:
    if not isinstance(total, LaneArrayType):

        def of_numbers(weights: Any, rows: Any, total: Any) -> None:
            size = rows.shape[1]
            for e in range(0, size, WIDTH):
                some = 0.0
                for r in range(len(rows)):
                    some += weights[r] * neighbours(rows, r * size + e)
                write_neighbours(total, e, some)

        return of_numbers

    def of_lanes(weights: Any, rows: Any, total: Any) -> None:
        # Four sums at a time: an addition waits for the one before it in its sum.
        for e in range(0, rows.shape[1], 4):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for r in range(len(rows)):
                weight = weights[r]
                a += weight * rows[r, e]
                b += weight * rows[r, e + 1]
                c += weight * rows[r, e + 2]
                d += weight * rows[r, e + 3]
            total[e], total[e + 1], total[e + 2], total[e + 3] = a, b, c, d

    return of_lanes


@njit_in_flight()
def _power_of_two(whole: float) -> float:
    return np.int64((int(whole) + 1023) << 52).view(np.float64)


def power_of_two(whole: Any) -> Any:
    """Return 2^``whole`` for whole numbers from -1022 to 1023, by the bits of a normal number."""
    return _power_of_two(whole)


@overload(power_of_two, strict=False)
def _power(whole: Any) -> Any:
    if isinstance(whole, LanesType):
        return lambda whole: powers_of_two(whole)
    return lambda whole: _power_of_two(whole)

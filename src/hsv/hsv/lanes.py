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
from numba import njit
from numba.extending import overload

from hsv.lane_types import (
    WIDTH,
    LaneArray,
    LaneArrayType,
    LaneRecord,
    LanesType,
    MaskType,
    all_of,
    lane_numbers,
    one_lane,
    powers_of_two,
    select,
)
from hsv.lane_types import with_lane as inserted

__all__ = [
    "WIDTH",
    "LaneArray",
    "LaneRecord",
    "choose",
    "every",
    "lane",
    "lanes_in",
    "least",
    "most",
    "power_of_two",
    "room",
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
    """Return what ``value``, a number, a condition or an array of one axis, is in a lane."""
    return value


@overload(lane, strict=False)
def _lane_of(value: Any, index: Any) -> Any:
    if isinstance(value, LanesType | MaskType):
        return lambda value, index: one_lane(value, index)
    if isinstance(value, LaneArrayType):
        return lambda value, index: lane_numbers(value, index)
    return lambda value, index: value


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


def room(given: LaneArray | None, size: int) -> Any:
    """Return ``given``, or, where none is, a new array of so many zeros."""
    return np.zeros(size) if given is None else given


@overload(room, strict=False)
def _room(given: Any, size: Any) -> Any:
    if isinstance(given, LaneArrayType):
        return lambda given, size: given
    return lambda given, size: np.zeros(size)


@njit(cache=True)
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

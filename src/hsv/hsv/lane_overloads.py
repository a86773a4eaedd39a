"""What the functions of :mod:`hsv.lanes` are in compiled functions, of numbers and of lanes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import float64
from numba.extending import overload

from hsv.lane_instructions import (
    PART,
    SUMS,
    all_of,
    neighbours,
    one_lane,
    powers_of_two,
    select,
    write_neighbours,
    write_sums,
)
from hsv.lane_instructions import with_lane as inserted
from hsv.lane_types import REGISTER, WIDTH, LaneArrayType, LanesType, MaskType
from hsv.lanes import (
    choose,
    every,
    lane,
    lanes_in,
    least,
    most,
    power_of_two,
    power_of_two_of_number,
    weighted_sum,
    with_lane,
)


@overload(every, strict=False)
def _every(condition: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition: all_of(condition)
    return lambda condition: condition


@overload(choose, strict=False)
def _choose(condition: Any, a: Any, b: Any) -> Any:
    if isinstance(condition, MaskType):
        return lambda condition, a, b: select(condition, a, b)
    return lambda condition, a, b: a if condition else b


@overload(lanes_in, strict=False)
def _lanes_in(value: Any) -> Any:
    count = value.count if isinstance(value, LanesType | LaneArrayType) else 1
    return lambda value: count


@overload(lane, strict=False)
def _lane_of(value: Any, index: Any) -> Any:
    if isinstance(value, LanesType | MaskType):
        return lambda value, index: one_lane(value, index)
    return None if isinstance(value, LaneArrayType) else lambda value, index: value


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


@overload(with_lane, strict=False)
def _with(value: Any, index: Any, number: Any) -> Any:
    if isinstance(value, LanesType):
        return lambda value, index, number: inserted(value, index, number)
    return lambda value, index, number: number


@overload(weighted_sum)
def _weighted_sum(weights: Any, rows: Any, total: Any) -> Any:
    if not isinstance(total, LaneArrayType):

        def of_numbers(weights: Any, rows: Any, total: Any) -> None:
            size = rows.shape[1]
            for e in range(0, size, REGISTER):
                some = 0.0
                for r in range(len(rows)):
                    some += weights[r] * neighbours(rows, r * size + e)
                write_neighbours(total, e, some)

        return of_numbers

    together = all(
        isinstance(kind, LaneArrayType) and kind.ndim == 1 and kind.count == WIDTH and not kind.split
        for kind in (weights, total)
    )
    if not (together and rows.ndim == 2 and rows.layout == "C" and rows.dtype == float64):
        return None

    def of_lanes(weights: Any, rows: Any, total: Any) -> None:
        for part in range(0, WIDTH, PART):
            for e in range(0, rows.shape[1], SUMS):
                write_sums(weights, rows, total, e, part)

    return of_lanes


@overload(power_of_two, strict=False)
def _power(whole: Any) -> Any:
    if isinstance(whole, LanesType):
        return lambda whole: powers_of_two(whole)
    return lambda whole: power_of_two_of_number(whole)

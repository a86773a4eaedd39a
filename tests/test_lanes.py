"""A function compiled for lanes gives each lane the bits that it gives one number."""

import math
from collections import namedtuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from hsv import lanes
from hsv.compiled import njit
from hsv.elementary import exponential, sine_cosine
from hsv.lane_types import WIDTH
from hsv.lanes import LaneArray, LaneRecord, choose, every, lane, least, most, weighted_sum, with_lane

VALUES = [0.0, -0.0, 1.0, -3.5, 0.1, 0.7, -0.8, 30.0, 1e-310, 1e308, -709.0, 701.0, math.inf, -math.inf, math.nan]


def each(function, *arguments):
    """Return what a compiled function of numbers writes (n), of each set of ``arguments`` and of lanes of them."""
    columns = np.array(np.broadcast_arrays(*arguments))
    n = len(function(*[np.full(1, a) for a in columns[:, 0]]))
    alone = np.array([function(*(np.array([a]) for a in row)) for row in columns.T])
    together = np.empty_like(alone)
    for start in range(0, len(alone), WIDTH):
        rows = [min(start + i, len(alone) - 1) for i in range(WIDTH)]
        out = LaneArray.zeros(n)
        function.py_call(*(LaneArray(np.ascontiguousarray(column[rows])[None]) for column in columns), out)
        for i, row in enumerate(rows):
            together[row] = out.array[:, i]
    return alone, together


def compiled(write, n):
    """Return ``write`` (arguments, out), compiled, as a function that returns what it wrote of numbers."""
    found = njit(error_model="numpy")(write)

    def alone(*arguments):
        out = np.zeros(n)
        found(*arguments, out)
        return out

    alone.py_call = found
    return alone


def same_bits(a, b):
    unknown = np.isnan(a) & np.isnan(b)  # a NaN is a NaN, whatever its bits
    return bool(np.all(unknown | (a.view(np.int64) == b.view(np.int64))))


def arithmetic(x, y, out):
    a, b = x[0], y[0]
    out[0], out[1], out[2], out[3] = a + b, a - b, a * b, a / b
    out[4], out[5], out[6], out[7] = -a, abs(a), min(a, b), max(a, b)
    out[8], out[9] = np.sqrt(abs(b)), a + 2 * b - 1.0 / 3
    out[10] = choose((a < b) & math.isfinite(a) | (a == 0.7), a, b)
    out[11] = choose(math.isfinite(a), 1.0, 0.0)
    out[12] = choose(a != a, 1, 2.0)
    total = 0.0
    total += a
    total *= b
    out[13] = total


def elementary(x, out):
    out[0], out[1] = sine_cosine(x[0])
    out[2] = exponential(x[0])


def test_arithmetic_and_comparisons_are_those_of_numbers():
    pairs = [(a, b) for a in VALUES for b in VALUES]
    assert same_bits(*each(compiled(arithmetic, 14), *np.array(pairs).T))


def test_elementary_functions_are_those_of_numbers_near_zero_far_away_and_mixed():
    random = np.random.default_rng(1)
    groups = (random.uniform(-0.7, 0.7, 400), random.uniform(-9e4, 9e4, 400), random.normal(0.0, 1.0, 400), VALUES)
    for values in groups:
        assert same_bits(*each(compiled(elementary, 3), np.array(values)))


def test_a_condition_of_all_lanes_and_the_ends_of_a_value():
    @njit()
    def found(x, limits, out):
        for i in range(len(limits)):
            out[i, 0] = choose(every(x[0] < limits[i]), 1.0, 0.0)
        out[0, 1], out[0, 2] = least(x[0]), most(x[0])
        out[1, 1] = lane(x[0], 2)
        out[1, 2] = lane(with_lane(x[0], 1, 99.0), 1)

    x = LaneArray(np.arange(float(WIDTH))[None].copy())
    out = np.zeros((2, 3))
    found(x, np.array([WIDTH - 1.0, WIDTH - 0.5]), out)
    assert out.tolist() == [[0.0, 0.0, WIDTH - 1.0], [1.0, 2.0, 99.0]]


def test_arrays_are_indexed_as_those_of_numbers_split_or_not():
    @njit()
    def doubled(given, out):
        for i in range(len(given)):
            row = given[i]
            for j in range(len(row)):
                out[i, j] = 2.0 * row[j] + given[i, j]

    numbers = np.random.default_rng(2).normal(size=(WIDTH, 3, 4))
    out = LaneArray(np.zeros((WIDTH, 3, 4)), split=True)
    doubled(LaneArray.of(numbers), out)
    assert np.array_equal(out.array, 3.0 * numbers)
    doubled(LaneArray(np.zeros((WIDTH, 5, 4))[:, :3], split=True), out)
    assert not out.array.any()
    with pytest.raises(ValueError, match="expected contiguous float64"):
        LaneArray(np.zeros((3, WIDTH), np.float32))


def test_a_record_has_the_numbers_of_each_lane_by_name():
    Pair = namedtuple("Pair", "first second")

    @njit()
    def difference(record, out):
        out[0] = record.first - record.second

    out = LaneArray.zeros(1)
    difference(LaneRecord([Pair(float(i), 0.5) for i in range(WIDTH)]), out)
    assert out.array[0].tolist() == [i - 0.5 for i in range(WIDTH)]


def test_lanes_do_not_decide_a_branch():
    @njit()
    def branch(x, out):
        if x[0] > 1.0:
            out[0] = 1.0

    with pytest.raises(TypingError):
        branch(LaneArray.zeros(1), LaneArray.zeros(1))


def test_of_a_number_the_functions_are_what_they_say():
    assert every(True) and choose(False, 1, 2) == 2 and least(3.0) == most(3.0) == lane(3.0, 0) == 3.0
    assert lanes.lanes_in(1.0) == 1 and with_lane(1.0, 0, 2.0) == 2.0 and lanes.power_of_two(-3.0) == 0.125


@njit()
def _sum(weights, rows, total):
    weighted_sum(weights, rows, total)


@pytest.mark.parametrize("blocks", [0, 1, 3])
def test_a_weighted_sum_has_the_bits_of_sums_in_the_order_of_the_rows(blocks):
    drawn = np.random.default_rng(5)
    size = blocks * lanes.BLOCK
    rows = drawn.standard_normal((7, size)) * 10.0 ** drawn.integers(-9, 9, (7, size))
    weights = drawn.standard_normal((7, WIDTH))
    rows[:, :1], weights[:, 0] = -0.0, 1.0  # the sum of zeros below zero is zero
    expected = np.empty((size, WIDTH))
    for flight in range(WIDTH):
        lanes.weighted_sum(weights[:, flight], rows, expected[:, flight])
        alone = np.empty(size)
        _sum(np.ascontiguousarray(weights[:, flight]), rows, alone)
        assert alone.tobytes() == expected[:, flight].tobytes()
    together = LaneArray.zeros(size)
    _sum(LaneArray(weights), rows, together)
    assert together.array.tobytes() == expected.tobytes()


@pytest.mark.parametrize("wrong", ["split weights", "split total", "fewer lanes", "rows of Fortran's order"])
def test_a_weighted_sum_refuses_what_it_would_read_wrongly(wrong):
    weights, total, rows = LaneArray.zeros(7), LaneArray.zeros(lanes.BLOCK), np.zeros((7, lanes.BLOCK))
    if wrong == "split weights":
        weights = LaneArray(np.zeros((WIDTH, 7)), split=True)
    elif wrong == "split total":
        total = LaneArray(np.zeros((WIDTH, lanes.BLOCK)), split=True)
    elif wrong == "fewer lanes":
        weights, total = (LaneArray(np.zeros((n, WIDTH // 2))) for n in (7, lanes.BLOCK))
    else:
        rows = np.asfortranarray(rows)
    with pytest.raises(TypingError):
        _sum(weights, rows, total)


@pytest.mark.parametrize("shape", [1, 7, (3, 5)])
def test_arrays_of_lanes_begin_with_a_line_of_the_cache(shape):
    zeros = LaneArray.zeros(shape)
    copied = LaneArray.of([np.full(shape, float(i)) for i in range(3)])
    assert zeros.address % 64 == copied.address % 64 == 0
    assert not zeros.array.any() and (copied.array == [0.0, 1.0, 2.0]).all()


def test_an_array_of_lanes_is_no_number():
    with pytest.raises(TypingError):
        njit()(lambda x: lane(x, 0))(LaneArray.zeros(1))

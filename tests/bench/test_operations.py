"""The count of a flight's arithmetic, and the limits of the processor."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hsv.bench.roofline import against_roofline, multiply_and_add

from hsv.bench.operations import Counted, counting
from hsv.simulation.history import History


@pytest.fixture
def done(monkeypatch):
    operations = {}
    monkeypatch.setattr(Counted, "done", operations)
    return operations


def test_operations_are_counted_once_for_the_same_operands(done):
    a, b = Counted(3.0), Counted(4.0)
    total = a * b + a * b + 1.0 * a - 2.0
    assert total == 25.0
    # a b, its sum with itself, the product with a constant, a sum, a difference.
    assert len(done) == 5
    assert 1.0 * a + 1.0 * Counted(3.0) == 6.0
    # Another number of the same value is another operand.
    assert len(done) == 7


def test_numpy_counts_as_well(done):
    assert np.sqrt(Counted(9.0)) == 3.0
    assert np.float64(2.0) * Counted(3.0) == 6.0
    assert -abs(Counted(-3.0)) == -3.0
    assert [key[0] for key in done] == [np.sqrt, np.multiply, np.fabs, np.negative]
    assert all(isinstance(result, Counted) for result, _ in done.values())


def test_all_numbers_but_those_of_a_history_are_counted():
    history = History.empty(2, estimated=False)
    whole = np.zeros(2, int)
    array, kept, number, integers = counting((np.ones((2, 2)), history, 1.0, whole))
    assert isinstance(array[1, 1], Counted) and isinstance(number, Counted)
    assert kept is history and integers is whole


INTERPRETED = """
from flights import components
from hsv.bench.operations import count
from hsv.simulation.closed_loop import fly
print(*count(5), fly(components(duration=0.1)).fingerprint)
"""


def test_counting_changes_no_bit_of_a_flight():
    ran = subprocess.run(
        [sys.executable, "-c", INTERPRETED],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    number, counted, alone = ran.stdout.split()
    assert counted == alone
    # 20 vertices of 71 entries are weighted by a product and a sum each, in the plan of every step.
    assert int(number) > 5 * 2 * 20 * 71


def test_a_flight_stays_below_what_the_processor_could_do():
    [measured] = against_roofline(2)
    assert 0.0 < measured.median < 1.0
    assert measured.is_rate and not measured.verdict
    assert int(measured.note.split(" operations a step")[0]) > 2 * 20 * 71


def test_products_and_sums_of_the_measured_rate_are_rounded_each():
    # In one rounding the product's last bits would be left.
    factor, term = 1.0 + 2.0**-30, -(1.0 + 2.0**-29)
    x = np.full(12, 1.0 + 2.0**-30)
    multiply_and_add(x, factor, term, 1)
    assert np.all(x == 0.0)

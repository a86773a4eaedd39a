import numpy as np
import pytest

from hsv.base.errors import ParameterError
from hsv.control.design import certified, compact, scheduled_changes

SCALAR, DIAGONAL = np.full(5, 0.8), np.array([0.8, 0.6, 1.0, 1.0, 1.0])


@pytest.mark.parametrize("values", [[0.8], [0.93], [1.0], [0.9] * 5])
def test_everything_between_the_minimum_and_one_is_certified(values):
    np.testing.assert_array_equal(certified(values, SCALAR), np.full(5, values[0]))


def test_five_equal_factors_are_written_as_one():
    np.testing.assert_array_equal(compact(np.full(5, 0.9)), [0.9])
    np.testing.assert_array_equal(compact(DIAGONAL), DIAGONAL)


def test_a_diagonal_factor_moves_all_dimensions_together():
    half_way = [0.9, 0.8, 1.0, 1.0, 1.0]
    np.testing.assert_array_equal(certified(half_way, DIAGONAL), half_way)


def test_a_change_has_one_value_or_five():
    flown = {"tau_change.starts": [1.0, 2.0]}
    for values in ([0.9, 0.8], [0.9] * 5 + [0.8] * 5):
        (first, nine), (second, eight) = scheduled_changes(flown | {"tau_change.values": values}, SCALAR, 0.02)
        assert (first, second) == (50, 100)
        np.testing.assert_array_equal([nine, eight], [np.full(5, 0.9), np.full(5, 0.8)])
    for count in (1, 3, 5, 7):
        with pytest.raises(ParameterError, match=rf"tau_change\.values: {count} values, expected 2 or 10"):
            scheduled_changes(flown | {"tau_change.values": [0.9] * count}, SCALAR, 0.02)


@pytest.mark.parametrize(
    ("values", "minimum", "message"),
    [
        ([0.79], SCALAR, r"feedback\.tau = 0\.79: expected 0\.8 to 1"),
        ([1.0, 0.7, 1.0, 1.0, 1.0], SCALAR, r"feedback\.tau\[1\] = 0\.7: expected 0\.8 to 1"),
        ([0.9, 1.0, 1.0, 1.0, 1.0], SCALAR, "all the same share of the way from 1"),
        ([0.8, 1.0, 1.0, 1.0, 1.0], DIAGONAL, "all the same share of the way from 1"),
        ([0.9], DIAGONAL, r"feedback\.tau = \[0\.9, .*the way from 1 to \[0\.8, 0\.6, 1\.0, 1\.0, 1\.0\]"),
        ([0.9], np.ones(5), "expected 1: no other factor is certified"),
    ],
)
def test_what_is_not_certified_is_refused(values, minimum, message):
    with pytest.raises(ParameterError, match=message):
        certified(values, minimum)

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from hsv.control.optimisation import BOUND_DIGITS, outward, rounded


def test_digits_are_counted_from_the_size_not_the_value():
    values = np.array([12.3456789, 0.00123456, 1e-9, -1e-9])
    assert rounded(values, 10.0, 4).tolist() == [12.346, 0.001, 0.0, 0.0]
    assert not np.signbit(rounded(values, 10.0, 4)).any()
    assert rounded(values, [10.0, 0.001, 1e-9, 1e-9], 1).tolist() == [12.0, 0.0012, 1e-9, -1e-9]


@given(st.floats(1e-12, 1e12), st.sampled_from([-1.0, 1.0]))
@example(1.000000000001, -1.0)  # less than the margin above a bound that it is rounded to
def test_bounds_grow_by_no_more_than_their_last_digit(size, sign):
    value = outward(np.array([sign * size]))[0]
    assert np.sign(value) == sign
    # The margin of outward, and a hundredth of it for the rounding of these operations, some 5e-16.
    assert -1.01e-12 <= abs(value) / size - 1.0 <= 10.0 ** (1 - BOUND_DIGITS)
    assert outward(np.array([value]))[0] == value

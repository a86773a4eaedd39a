import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from hsv.vehicle.dynamics import derivative
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.trim import trim
from hsv.vehicle.vehicle import load_vehicle

VEHICLE = load_vehicle().coupled("derived")
START = trim(VEHICLE, 26060.4, 2407.92)
INPUT = START.input + np.array([0.1, 0.01])
"""Away from trim, so that everything moves."""


def flown(duration, substeps):
    x = START.state.copy()
    advance(x, INPUT, VEHICLE, duration, substeps, workspace())
    return x


@pytest.fixture(scope="module")
def exact():
    def slope(_, x):
        out = np.empty(9)
        derivative(x, INPUT, VEHICLE, out)
        return out

    return solve_ivp(slope, (0.0, 1.0), START.state, method="DOP853", rtol=1e-13, atol=1e-12).y[:, -1]


def test_agrees_with_an_adaptive_integrator_of_eighth_order(exact):
    assert_allclose(flown(1.0, 2000), exact, rtol=1e-10, atol=2e-9)


def test_error_falls_with_the_fourth_power_of_the_step(exact):
    errors = [np.abs(flown(1.0, n) - exact)[[4, 5, 6, 7, 8]].max() for n in (50, 100, 200)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(orders, 4.0, atol=0.15)


def test_step_of_the_bench_is_accurate_enough(exact):
    # Two steps a period of 0.02 s: far below what any metric resolves.
    assert_allclose(flown(1.0, 100)[:5], exact[:5], rtol=1e-6, atol=1e-7)


def test_two_periods_in_a_row_are_one_of_both():
    x = START.state.copy()
    for _ in range(2):
        advance(x, INPUT, VEHICLE, 0.02, 2, workspace())
    assert_allclose(x, flown(0.04, 4), rtol=1e-15, atol=1e-16)


def test_trim_is_a_fixed_point():
    x = START.state.copy()
    for _ in range(500):
        advance(x, START.input, VEHICLE, 0.02, 2, workspace())
    # The unstable short-period pole makes 1e-14 of rounding grow to this within ten seconds.
    assert_allclose(x, START.state, rtol=1e-6, atol=1e-4)

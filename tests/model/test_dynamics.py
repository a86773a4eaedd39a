"""The equations of motion compared with the published ones, their integration, and trims."""

import math
import warnings

import numpy as np
import published_model as published
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from hsv.base.errors import TrimError
from hsv.model.dynamics import advance, derivative, jacobian
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

COUPLINGS = {"derived": published.DERIVED, "paper_like": published.PAPER_LIKE, 0.0: published.DECOUPLED}


def random_points(count=20, seed=3):
    """Return random states and inputs over the envelope, in motion: no state is zero and no term vanishes."""
    rng = np.random.default_rng(seed)
    low = np.array([85000, 7700, -0.1, -0.1, -0.2, -2, -20, -2, -20]) * published.STATE_UNITS
    high = np.array([86500, 8300, 0.2, 0.2, 0.2, 3, 20, 3, 20]) * published.STATE_UNITS
    return [(rng.uniform(low, high), rng.uniform([0.0, -0.5], [1.5, 0.5])) for _ in range(count)]


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_equations_agree_with_the_published_ones_in_their_own_units(coupling):
    vehicle = load_vehicle().coupled(coupling)
    for x, u in random_points():
        expected = published.derivative(x / published.STATE_UNITS, u, COUPLINGS[coupling]) * published.STATE_UNITS
        assert_allclose(derivative(x, u, vehicle), expected.astype(float), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_jacobians_agree_with_extrapolated_differences_of_the_published_model(coupling):
    vehicle = load_vehicle().coupled(coupling)
    point = trim(vehicle, 25908.0, 2347.594)
    for x, u in [(point.state, point.input), *random_points(3)]:
        A, B = jacobian(x, u, vehicle)
        y = x / published.STATE_UNITS
        psi = COUPLINGS[coupling]
        expected_A = published.jacobian(lambda s, u=u, psi=psi: published.derivative(s, u, psi), y)
        expected_B = published.jacobian(lambda v, y=y, psi=psi: published.derivative(y, v, psi), u)
        A = A / published.STATE_UNITS[:, None] * published.STATE_UNITS
        B = B / published.STATE_UNITS[:, None]
        assert_allclose(A, expected_A, rtol=1e-8, atol=1e-9)
        assert_allclose(B, expected_B, rtol=1e-8, atol=1e-9)


STILL = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""Conditions of :func:`forces` in still air: wind, density, factors on thrust, lift, drag, moment increment."""


def acceleration(x, d):
    """Return the forward and the upward acceleration of the inertial velocity."""
    path, turn = x[3] - x[2], d[3] - d[2]
    ahead = np.array([np.cos(path), np.sin(path)])
    return d[1] * ahead + x[1] * turn * np.array([-ahead[1], ahead[0]])


@pytest.mark.parametrize("wind", [(40.0, 0.0), (0.0, 9.0), (-25.0, -7.0)])
def test_uniform_wind_is_a_moving_frame(wind):
    # Galilean invariance: over flat ground, an observer who moves with the air sees the forces of still air.
    p = load_vehicle().coupled("derived")
    for x, u in random_points():
        seen = x.copy()
        velocity = x[1] * np.exp(1j * (x[3] - x[2])) - complex(*wind)
        seen[1], seen[2] = np.abs(velocity), x[3] - np.angle(velocity)
        d, expected = derivative(x, u, p, np.array([*wind, *STILL[2:]])), derivative(seen, u, p)
        assert d[0] == pytest.approx(expected[0] + wind[1], rel=1e-9)
        assert_allclose(acceleration(x, d), acceleration(seen, expected), rtol=1e-8, atol=1e-9)
        assert_allclose(d[3:], expected[3:], rtol=1e-9, atol=1e-9)


VEHICLE = load_vehicle().coupled("derived")
START = trim(VEHICLE, 26060.4, 2407.92)
INPUT = START.input + np.array([0.1, 0.01])
"""An input away from trim, so that all states change."""


@pytest.fixture(scope="module")
def exact():
    def slope(_, x):
        return derivative(x, INPUT, VEHICLE)

    return solve_ivp(slope, (0.0, 1.0), START.state, method="DOP853", rtol=1e-13, atol=1e-12).y[:, -1]


def flown(duration, substeps):
    return advance(START.state, INPUT, VEHICLE, duration, substeps)


def test_integration_agrees_with_an_adaptive_integrator_of_eighth_order(exact):
    assert_allclose(flown(1.0, 2000), exact, rtol=1e-10, atol=2e-9)


LIMITS = load_vehicle().decoupled


def rates(point, vehicle):
    return derivative(point.state, point.input, vehicle)


@pytest.mark.parametrize("coupling", [*load_vehicle().couplings, 0.0])
def test_residual_is_rounding_all_over_the_envelope(coupling):
    vehicle = load_vehicle().coupled(coupling)
    for altitude in np.linspace(*load_vehicle().altitude_range, 4):
        for velocity in np.linspace(*load_vehicle().velocity_range, 4):
            point = trim(vehicle, altitude, velocity)
            assert np.abs(rates(point, vehicle)).max() == point.residual < 1e-12
            assert np.all(point.input > LIMITS.input_minimum)
            assert np.all(point.input < LIMITS.input_maximum)
            assert point.state[0] == altitude
            assert point.state[1] == velocity


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ((60000.0, 2400.0), r"altitude = 60000 m, velocity = 2400 m/s: trim needs fuel_equivalence_ratio = -0\.\d+"),
        ((40000.0, 2400.0), r"altitude = 40000 m, .*trim needs elevator_deflection = 1\.\d+ rad, expected -0\.523599"),
        ((25908.0, 500.0), r"velocity = 500 m/s: no equilibrium"),
        ((25908.0, 0.0), r"velocity = 0 m/s: expected a finite altitude and a positive velocity"),
        ((math.nan, 2400.0), r"altitude = nan m.*expected a finite altitude"),
        ((26100.0, 2420.0, 2420.0, 0.0), r"climb rate = 2420 m/s.*expected a climb rate below the velocity"),
        ((26100.0, 2420.0, math.nan, 0.0), r"climb rate = nan m/s"),
        ((26100.0, 2420.0, 0.0, 30.0), r"acceleration = 30 m/s\^2: trim needs fuel_equivalence_ratio = \d"),
    ],
)
def test_where_there_is_no_trim_the_error_says_why(point, message):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(TrimError, match=message):
            trim(load_vehicle().coupled(), *point)


def test_a_climbing_trim_climbs_and_accelerates_and_nothing_else():
    vehicle = load_vehicle().decoupled
    point = trim(vehicle, 26100.0, 2420.0, 3.048, 1.27)
    np.testing.assert_allclose(rates(point, vehicle), [3.048, 1.27, 0, 0, 0, 0, 0, 0, 0], atol=1e-12)
    assert point.residual < 1e-12
    level = trim(vehicle, 26100.0, 2420.0)
    assert point.state[3] - point.state[2] == pytest.approx(math.asin(3.048 / 2420.0), rel=1e-12)
    assert point.input[0] > level.input[0]

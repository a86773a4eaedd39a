import numpy as np
import published_model as published
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from hsv.model.dynamics import advance, air_relative, derivative, forces, jacobian
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

COUPLINGS = {"derived": published.DERIVED, "paper_like": published.PAPER_LIKE, 0.0: published.DECOUPLED}


def random_points(count=20, seed=3):
    """States and inputs all over the envelope, in motion: nothing is zero and no term drops out."""
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


def test_forces_agree_with_the_published_ones():
    pound = published.SLUG * published.FOOT
    for x, u in random_points():
        lift, drag, thrust, moment, pressure = forces(x, u, load_vehicle().coupled())
        expected = published.forces(x / published.STATE_UNITS, u)
        assert_allclose([lift, drag, thrust], np.array(expected[:3], float) * pound, rtol=1e-11)
        assert moment == pytest.approx(float(expected[3]) * pound * published.FOOT, rel=1e-10)
        assert pressure > 0.0


@pytest.mark.parametrize("coupling", ["derived", "paper_like"])
def test_elastic_accelerations_satisfy_both_printed_equations(coupling):
    # Equation (1), line by line, with what the solution of the 2x2 system gives for the other acceleration.
    p = load_vehicle().coupled(coupling)
    psi_1, psi_2, inertia = p.inertial_coupling_1, p.inertial_coupling_2, p.moment_of_inertia
    for x, u in random_points():
        moment = forces(x, u, p)[3]
        d = derivative(x, u, p)
        decoupled = derivative(x, u, p.decoupled())
        first = (decoupled[6] - psi_1 * moment / inertia - psi_1 * psi_2 * d[8] / inertia) / (1 + psi_1**2 / inertia)
        second = (decoupled[8] - psi_2 * moment / inertia - psi_2 * psi_1 * d[6] / inertia) / (1 + psi_2**2 / inertia)
        assert_allclose(d[[6, 8]], [first, second], rtol=1e-11)
        assert d[4] == pytest.approx((moment + psi_1 * d[6] + psi_2 * d[8]) / inertia, rel=1e-11)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_energy_rate_is_power_of_thrust_minus_drag(coupling):
    # d(V^2 / 2 + g h) / dt = V (T cos a - D) / m: gravity does no net work, lift none at all.
    p = load_vehicle().coupled(coupling)
    for x, u in random_points():
        _, drag, thrust, *_ = forces(x, u, p)
        d = derivative(x, u, p)
        power = x[1] * (thrust * np.cos(x[2]) - drag) / p.mass
        assert x[1] * d[1] + p.gravity * d[0] == pytest.approx(power, rel=1e-9, abs=1e-6)


def test_flight_path_turns_by_the_force_across_it():
    # m V d(gamma)/dt = L + T sin a - m g cos(gamma), gamma = theta - a: equation (1) in flight-path form.
    p = load_vehicle().coupled()
    for x, u in random_points():
        lift, _, thrust, *_ = forces(x, u, p)
        d = derivative(x, u, p)
        across = lift + thrust * np.sin(x[2]) - p.mass * p.gravity * np.cos(x[3] - x[2])
        assert p.mass * x[1] * (d[3] - d[2]) == pytest.approx(across, rel=1e-9, abs=1e-5)


def test_free_elastic_modes_lose_energy_by_damping_alone():
    # Without generalised forces and coupling: d(rate^2 / 2 + omega^2 eta^2 / 2) / dt = -2 zeta omega rate^2.
    names = [n for n in load_vehicle().coupled()._fields if n.startswith("elastic_force")]
    p = load_vehicle().decoupled._replace(**dict.fromkeys(names, 0.0))
    for x, u in random_points():
        d = derivative(x, u, p)
        for coordinate, rate, omega, zeta in (
            (5, 6, p.natural_frequency_1, p.damping_ratio_1),
            (7, 8, p.natural_frequency_2, p.damping_ratio_2),
        ):
            power = x[rate] * d[rate] + omega**2 * x[coordinate] * x[rate]
            assert power == pytest.approx(-2 * zeta * omega * x[rate] ** 2, rel=1e-9, abs=1e-9)


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
"""Conditions of :func:`forces`: wind, density, factors of thrust, lift and drag, increment of the moment."""


def acceleration(x, d):
    """Forward and upward acceleration of the inertial velocity."""
    path, turn = x[3] - x[2], d[3] - d[2]
    ahead = np.array([np.cos(path), np.sin(path)])
    return d[1] * ahead + x[1] * turn * np.array([-ahead[1], ahead[0]])


def test_air_relative_velocity_is_the_difference_of_two_vectors():
    for x, _ in random_points():
        path = np.exp(1j * (x[3] - x[2]))
        speed, turn, sin, cos = air_relative(x[1], x[3] - x[2], 30.0, -12.0)
        assert_allclose(speed * np.exp(1j * turn) * path, x[1] * path - (30.0 - 12.0j), rtol=1e-14)
        assert_allclose([sin, cos], [np.sin(turn), np.cos(turn)], rtol=1e-12)


@pytest.mark.parametrize("wind", [(40.0, 0.0), (0.0, 9.0), (-25.0, -7.0)])
def test_uniform_wind_is_a_moving_frame(wind):
    # Galileo: over flat ground, forces and accelerations are those that an observer in the air sees in still air.
    p = load_vehicle().coupled("derived")
    for x, u in random_points():
        seen = x.copy()
        velocity = x[1] * np.exp(1j * (x[3] - x[2])) - complex(*wind)
        seen[1], seen[2] = np.abs(velocity), x[3] - np.angle(velocity)
        d, expected = derivative(x, u, p, np.array([*wind, *STILL[2:]])), derivative(seen, u, p)
        assert d[0] == pytest.approx(expected[0] + wind[1], rel=1e-9)
        assert_allclose(acceleration(x, d), acceleration(seen, expected), rtol=1e-8, atol=1e-9)
        assert_allclose(d[3:], expected[3:], rtol=1e-9, atol=1e-9)


def test_density_acts_on_all_forces_of_the_air_but_not_on_thrust():
    p = load_vehicle().coupled()
    denser = p._replace(reference_density=1.1 * p.reference_density)
    conditions = STILL.copy()
    conditions[2] = 1.1
    for x, u in random_points():
        assert_allclose(derivative(x, u, p, conditions), derivative(x, u, denser), rtol=1e-8, atol=1e-8)


def test_factors_of_the_engine_scale_their_forces():
    p = load_vehicle().coupled()
    less = p._replace(**{f"thrust_beta_{i}": 0.3 * getattr(p, f"thrust_beta_{i}") for i in range(1, 9)})
    less = less._replace(**{n: 0.8 * getattr(p, n) for n in p._fields if n.startswith("lift_")})
    less = less._replace(**{n: 1.2 * getattr(p, n) for n in p._fields if n.startswith("drag_")})
    less = less._replace(moment_zero=p.moment_zero + 0.05)
    conditions = np.array([0.0, 0.0, 1.0, 0.3, 0.8, 1.2, 0.05])
    for x, u in random_points():
        assert_allclose(derivative(x, u, p, conditions), derivative(x, u, less), rtol=1e-8, atol=1e-8)


VEHICLE = load_vehicle().coupled("derived")
START = trim(VEHICLE, 26060.4, 2407.92)
INPUT = START.input + np.array([0.1, 0.01])
"""Away from trim, so that everything moves."""


@pytest.fixture(scope="module")
def exact():
    def slope(_, x):
        return derivative(x, INPUT, VEHICLE)

    return solve_ivp(slope, (0.0, 1.0), START.state, method="DOP853", rtol=1e-13, atol=1e-12).y[:, -1]


def flown(duration, substeps):
    return advance(START.state, INPUT, VEHICLE, duration, substeps)


def test_integration_agrees_with_an_adaptive_integrator_of_eighth_order(exact):
    assert_allclose(flown(1.0, 2000), exact, rtol=1e-10, atol=2e-9)


def test_error_of_the_integration_falls_with_the_fourth_power_of_the_step(exact):
    errors = [np.abs(flown(1.0, n) - exact)[[4, 5, 6, 7, 8]].max() for n in (50, 100, 200)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert_allclose(orders, 4.0, atol=0.15)


def test_trim_is_a_fixed_point():
    x = START.state
    for _ in range(500):
        x = advance(x, START.input, VEHICLE, 0.02, 2)
    # The unstable short-period pole makes 1e-14 of rounding grow to this within ten seconds.
    assert_allclose(x, START.state, rtol=1e-6, atol=1e-4)

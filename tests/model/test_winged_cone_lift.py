"""The lift of the Winged-Cone's elevator, against a text of the equations of its own, and the zero that it causes."""

import math

import numpy as np
import pytest

from hsv.control.linear_model import linearise
from hsv.model.dynamics import derivative
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle, load_vehicle

FOOT, SLUG = 0.3048, 14.593902937206
CRUISE = 110_000 * FOOT, 15_060 * FOOT


@pytest.fixture(scope="module")
def vehicle():
    """Return the parameters of the vehicle."""
    return load_vehicle("winged_cone_lift").coupled()


def rates(h, v, path, alpha, q, fuel, elevator):
    """Return V' (ft/s^2), gamma' and q' by Wang and Stengel's equations in feet and slugs, Wallace's lift added."""
    mass, inertia, area, chord, radius = 9375.0, 7e6, 3603.0, 80.0, 20_903_500.0 + h
    mach = v / (8.99e-9 * h * h - 9.16e-4 * h + 996.0)
    force = 0.5 * 0.00238 * math.exp(-h / 24_000.0) * v * v * area
    lift = alpha * (0.493 + 1.91 / mach)
    lift += (-0.2355807 * alpha**2 - 0.004518129 * alpha - 0.02913350) * elevator
    drag = 0.0082 * (171.0 * alpha**2 + 1.15 * alpha + 1.0) * (0.0012 * mach**2 - 0.054 * mach + 1.0)
    thrust = 0.0105 * (1.0 + 17.0 / mach) * (1.15 * fuel if fuel <= 1.0 else 1.0 + 0.15 * fuel)
    moment = 1e-4 * (0.06 - math.exp(-mach / 3.0)) * (-6565.0 * alpha**2 + 6875.0 * alpha + 1.0)
    moment += 0.0292 * (elevator - alpha)
    moment += 0.5 * chord * q / v * (-0.025 * mach + 1.37) * (-6.83 * alpha**2 + 0.303 * alpha - 0.23)
    weight = 1.39e16 / radius**2
    along = force * (thrust * math.cos(alpha) - drag) / mass - weight * math.sin(path)
    turn = force * (thrust * math.sin(alpha) + lift) / (mass * v) - (weight - v * v / radius) * math.cos(path) / v
    return along, turn, force * chord * moment / inertia


def test_ten_states_accelerate_as_an_independent_text_of_the_equations_says(vehicle):
    rng = np.random.default_rng(20230)
    for _ in range(10):
        h, v = rng.uniform(105e3, 115e3), rng.uniform(14.5e3, 15.5e3)
        path, alpha, q, elevator = rng.uniform(-0.1, 0.1, 4)
        fuel = rng.uniform(0.1, 1.4)
        state = np.array([h * FOOT, v * FOOT, alpha, path + alpha, q, 0.0, 0.0, 0.0, 0.0])
        found = derivative(state, np.array([fuel, elevator]), vehicle)
        along, turn, pitch = rates(h, v, path, alpha, q, fuel, elevator)
        assert [found[1] / FOOT, q - found[2], found[4]] == pytest.approx([along, turn, pitch], rel=1e-9, abs=1e-12)


def test_it_trims_with_less_angle_of_attack_as_the_elevator_carries_a_little(vehicle):
    point = trim(vehicle, *CRUISE)
    assert [point.state[2], point.input[0], point.input[1]] == pytest.approx([0.03090, 0.1756, -0.00689], rel=5e-4)


def test_the_lift_gives_a_zero_in_the_right_half_plane_which_the_vehicle_without_it_does_not_have():
    with_lift, without = (linearise(*CRUISE, vehicle=name) for name in ("winged_cone_lift", "winged_cone"))
    assert without.zeros == []
    assert sorted(zero.pole.real for zero in with_lift.zeros) == pytest.approx([-8.462, 8.394], abs=5e-4)


def test_a_vehicle_without_the_coefficients_is_the_one_that_it_was_before_they_existed():
    values = load_vehicle("winged_cone").to_parameters()
    assert not any("lift_elevator" in name for name in values)
    lifted = load_vehicle("winged_cone_lift")
    assert Vehicle.from_parameters(lifted.to_parameters()).digest == lifted.digest
    assert lifted.to_parameters()["vehicle.lift_elevator"] == -0.0291335

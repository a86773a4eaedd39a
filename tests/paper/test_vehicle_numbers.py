"""Numbers that the literature prints, or that follow from its table, in its units."""

import numpy as np
import pytest

from hsv.base.units import factor
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import modes
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

LIMITS = load_vehicle().decoupled

FOOT = 0.3048
ELASTIC = factor("kg^0.5 m", "slug^0.5 ft")
ALTITUDE, VELOCITY = 85000 * FOOT, 7702.0808 * FOOT


def lightly_damped(vehicle):
    point = trim(vehicle, ALTITUDE, VELOCITY)
    A, _ = jacobian(point.state, point.input, vehicle)
    return sorted(
        (mode.natural_frequency, mode.damping_ratio)
        for mode in modes(A)
        if 0 < mode.damping_ratio < 0.1 and mode.natural_frequency > 5
    )


def test_elastic_trim_is_within_half_a_percent_of_the_full_model():
    # Parker et al.: eta 0.9700 and 0.7967 at this point, full model with canard.
    point = trim(load_vehicle().coupled(), ALTITUDE, VELOCITY)
    assert point.state[5] * ELASTIC == pytest.approx(0.9700, rel=5e-3)
    assert point.state[7] * ELASTIC == pytest.approx(0.7967, rel=5e-3)


@pytest.mark.parametrize(
    ("kappa", "expected"),
    [
        (0.0, [(16.02, 0.0200), (19.58, 0.0200)]),
        (0.25, [(15.89, 0.0198), (19.47, 0.0199)]),
        (0.5, [(15.43, 0.0191), (19.23, 0.0197)]),
        (1.0, [(13.73, 0.0166), (18.80, 0.0197)]),
    ],
)
def test_coupled_poles(kappa, expected):
    found = lightly_damped(load_vehicle().coupled(kappa))
    assert [(round(frequency, 2), round(damping, 4)) for frequency, damping in found] == expected


def test_decoupled_model_keeps_structural_modes_exactly_and_rigid_poles_nearly():
    vehicle = load_vehicle().decoupled
    assert [f for f, _ in lightly_damped(vehicle)] == pytest.approx([16.02, 19.58], rel=1e-12)
    point = trim(vehicle, ALTITUDE, VELOCITY)
    poles = np.linalg.eigvals(jacobian(point.state, point.input, vehicle)[0])
    assert poles.real.max() == pytest.approx(1.69, abs=0.005)
    assert poles.real.min() == pytest.approx(-1.76, abs=0.005)


def test_coupled_model_has_the_seven_motion_modes_of_figure_4():
    # Five of the rigid body and two aeroelastic: a real pair, the phugoid pair, one at the origin; two pairs.
    vehicle = load_vehicle().coupled()
    point = trim(vehicle, ALTITUDE, VELOCITY)
    poles = np.linalg.eigvals(jacobian(point.state, point.input, vehicle)[0])
    assert np.sum(poles.real > 0.1) == 1
    assert np.sum((np.abs(poles) > 0.01) & (np.abs(poles) < 0.1)) == 2
    assert np.sum(np.abs(poles) < 1e-9) == 1
    assert np.sum(np.abs(poles.imag) > 10.0) == 4


def test_unstable_pole_over_the_envelope():
    # Control study, section 1: 1.65 to 1.80.
    vehicle = load_vehicle().decoupled
    found = []
    for altitude in np.linspace(*load_vehicle().altitude_range, 4):
        for velocity in np.linspace(*load_vehicle().velocity_range, 5):
            point = trim(vehicle, altitude, velocity)
            found.append(np.linalg.eigvals(jacobian(point.state, point.input, vehicle)[0]).real.max())
    assert min(found) == pytest.approx(1.65, abs=0.005)
    assert max(found) == pytest.approx(1.80, abs=0.005)


def test_conditions_of_section_5_1():
    assert pytest.approx((85000 * FOOT, 86500 * FOOT)) == load_vehicle().altitude_range
    assert pytest.approx((7700 * FOOT, 8300 * FOOT)) == load_vehicle().velocity_range
    assert [LIMITS.input_minimum[0], LIMITS.input_maximum[0]] == [0.0, 1.5]
    assert np.degrees([LIMITS.input_minimum[1], LIMITS.input_maximum[1]]) == pytest.approx([-30.0, 30.0])
    assert dict(load_vehicle().uncertainty) == pytest.approx(
        {
            "mass": 0.10,
            "moment_of_inertia": 0.10,
            "reference_area": 0.01,
            "thrust_moment_arm": 0.01,
            "mean_aerodynamic_chord": 0.01,
            "moment_elevator": 0.03,
            "thrust_beta_1": 0.03,
            "thrust_beta_3": 0.03,
            "thrust_beta_5": 0.03,
            "thrust_beta_7": 0.03,
        }
    )

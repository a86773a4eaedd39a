import numpy as np
import pytest
from scipy.linalg import expm

from hsv.control.design_file import find_design
from hsv.design.certified import Plan, load_certified
from hsv.design.hardware import verdict
from hsv.design.hardware.verdict import reaches
from hsv.model.actuators import SUBSTEPS
from hsv.model.lpv.actuated import actuator_system
from hsv.model.signals import INPUT_NAMES
from hsv.model.trim import trim


def test_no_error_in_the_set_moves_actuators_farther_or_faster(realistic):
    """Errors on the set's boundary, random ones and the worst for the rate, with disturbances at their bounds.

    The actuators move by the matrix exponential of their continuous-time equations.
    """
    design, found, plan = realistic.design, realistic.invariant_set(), Plan.of(realistic)
    fuel, elevator = sorted(reaches(found, design, plan), key=lambda reach: INPUT_NAMES.index(reach.channel))
    actuators = design.actuator_sets
    A, B, C, _ = actuator_system(actuators)
    a = len(A)
    flown, commands = plan.actuators(design)
    at_rest = trim(realistic.vehicle.decoupled, *plan.flight.history.state[0, :2]).input
    system, disturbance = found.problem.system, found.problem.disturbance
    generator = np.random.default_rng(1)
    factor = np.linalg.cholesky(found.Q)
    rate_state = system.names.index("elevator_deflection_rate") - len(system.names) + a
    lost = np.zeros((2, len(disturbance.lower)))
    lost[1, 3] = 1.0
    whole = np.block([[A, B], [np.zeros((2, a + 2))]])
    maps = [expm(whole * substep * design.period / SUBSTEPS)[:a] for substep in range(1, SUBSTEPS + 1)]
    largest = 0.0
    for number in range(400):
        k = int(generator.integers(len(flown)))
        v = generator.standard_normal(len(found.Q))
        e = found.centre + factor @ (v / np.linalg.norm(v))
        if number % 2:
            worst = np.zeros(len(found.Q))
            worst[-a + rate_state] = 1.0
            e = found.centre + found.Q @ worst / np.sqrt(worst @ found.Q @ worst)
        d = np.where(generator.random(len(disturbance.lower)) < 0.5, disturbance.lower, disturbance.upper)
        held = commands[k] + system.F @ e + (system.F_d + lost) @ d
        for over in maps:
            moved = over @ np.r_[flown[k] + e[-a:], held]
            position, rate = C @ moved + at_rest, A @ moved + B @ held
            for i, reach in enumerate((fuel, elevator)):
                assert reach.lowest <= position[i] <= reach.highest
            assert abs(rate[rate_state - 1]) <= elevator.rate
            largest = max(largest, abs(rate[rate_state - 1]))
    assert largest > 0.5 * elevator.rate


@pytest.mark.long
def test_a_design_that_knows_actuators_is_judged_with_those_that_fly(realistic):
    tube = realistic.certificate["tube"]
    known, ideal = verdict.certified_with(realistic, {}, "ideal")
    assert (known.name, ideal.name) == ("as certified", "ideal actuators")
    assert np.allclose(known.half_width, tube["invariant_set"]["half_width"][:5], rtol=1e-5)
    # Ideal actuators have no lag: the set is smaller, the feedback needs less input, and no reach is limited.
    assert np.all(ideal.half_width < known.half_width) and np.all(ideal.feedback < known.feedback)
    assert ideal.shares.min() > known.shares.min() and not ideal.reaches


def test_a_flight_may_start_where_both_ellipsoid_and_star_norms_allow_it():
    found = load_certified(find_design("tight")).invariant_set()
    at_rest = np.zeros(5)
    norms = found.star_norms.level_at_start(found.problem, found.centre)
    assert verdict._start(found, at_rest) == max(norms, found.levels(np.zeros(len(found.centre))))
    # This pitch-angle error is inside the ellipsoid; for star norms it is too large if one channel causes it.
    error = np.array([0.0, 0.0, 0.0, 0.1 * found.half_width[3], 0.0])
    assert max(found.levels(side * np.append(error, [0.0, 0.0])) for side in (1.0, -1.0)) < 1.0
    assert verdict._start(found, error) > 1.0

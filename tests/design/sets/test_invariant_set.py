import dataclasses

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.design.sets.invariant_set import ellipsoid
from hsv.design.tightening import check_plan, tighten
from hsv.model.vehicle import load_vehicle

FOOT = 0.3048
ACCEPTED = 1.2 * 1.1 * np.array([42.0 * FOOT, 11.0 * FOOT, *np.radians([2.0, 1.9, 2.9])])


def test_half_widths_are_those_of_the_study(found):
    assert np.all(found.half_width[:5] <= ACCEPTED)


def test_certificate_holds_and_fails_just_beyond(found):
    assert min(found.certify()["lmi_smallest_eigenvalues"]) > 0.0
    with pytest.raises(DesignError, match="inequality at vertex"):
        dataclasses.replace(found, Q=0.99 * found.Q).certify()


def test_boundary_points_stay_inside_under_extreme_disturbances_at_every_vertex(found):
    rng = np.random.default_rng(3)
    factor = np.linalg.cholesky(found.Q)
    system, w = found.problem.system, found.problem.disturbance
    directions = rng.normal(size=(2000, len(factor)))
    errors = found.centre + directions / np.linalg.norm(directions, axis=1)[:, None] @ factor.T
    signs = rng.choice((0.0, 1.0), size=(2000, 7))
    d = w.lower + signs * (w.upper - w.lower)
    for A, G in zip(system.A, system.G, strict=True):
        assert found.levels(errors @ A.T + d @ G.T).max() <= 1.0


def test_half_the_disturbance_gives_half_the_set(found, inputs):
    problem = dataclasses.replace(found.problem, disturbance=found.problem.disturbance.scaled(0.5))
    scales = inputs.invariant_set.state_scale.array(), inputs.invariant_set.input_scale.array()
    half = ellipsoid(problem, *scales, [found.contraction])
    np.testing.assert_allclose(half.half_width, 0.5 * found.half_width, rtol=0.02)


LIMITS = load_vehicle().decoupled


@pytest.fixture(scope="module")
def bounds(found):
    return tighten(found, LIMITS.input_minimum, LIMITS.input_maximum)


def test_extremes_of_the_tube_just_reach_the_limits(found, bounds):
    system, w = found.problem.system, found.problem.disturbance
    for i in range(2):
        direction = found.Q @ system.F[i] / found.feedback[i]
        direct = np.sort([system.F_d[i] * w.lower, system.F_d[i] * w.upper], axis=0).sum(axis=1)
        most = system.F[i] @ (found.centre + direction) + direct[1]
        least = system.F[i] @ (found.centre - direction) + direct[0]
        assert bounds.upper[i] + most == pytest.approx(LIMITS.input_maximum[i])
        assert bounds.lower[i] + least == pytest.approx(LIMITS.input_minimum[i])


def test_a_plan_that_does_not_fit_is_refused_with_the_amount(bounds):
    highest = bounds.upper + np.array([-0.1, 0.02])
    with pytest.raises(DesignError, match=r"upper tightened bound of elevator_deflection by 0\.02 rad"):
        check_plan(bounds, bounds.lower, highest)

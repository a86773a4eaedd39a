import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.design.tightening import check_plan, tighten
from hsv.model.vehicle import load_vehicle

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

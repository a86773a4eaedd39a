import math
import warnings

import numpy as np
import pytest

from hsv.base.errors import TrimError
from hsv.model.dynamics import derivative
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

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

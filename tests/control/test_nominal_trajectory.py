import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.control.design_file import find_design, read_design
from hsv.control.nominal_law import FamilyLaw, KothareLaw
from hsv.control.nominal_trajectory import NominalStatus, NominalTrajectory
from hsv.control.qp_law import QpLaw
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

DESIGN = read_design(find_design("baseline"))
START = trim(load_vehicle().coupled(), 26060.4, 2407.92)
TARGET = {"reference.altitudes": [26243.28], "reference.velocities": [2484.12]}


def nominal(**changes):
    return NominalTrajectory.from_parameters({**TARGET, **changes}, DESIGN)


def test_the_law_is_the_one_that_is_asked_for():
    for name, law in (("family", FamilyLaw), ("qp", QpLaw), ("kothare_online", KothareLaw)):
        assert type(nominal(**{"nominal.law": name}).law) is law


def test_reference_is_the_trim_of_the_command():
    result = nominal().step(START.state)
    expected = trim(load_vehicle().coupled(), 26243.28, 2484.12)
    assert_allclose(result.reference, expected.state, rtol=1e-12)
    assert_allclose(result.reference_input, expected.input, rtol=1e-12)
    assert_array_equal(result.deviation, START.state - result.reference)
    assert result.status == NominalStatus.OK


def test_obeys_the_nominal_system_scheduled_by_the_measured_state():
    rng = np.random.default_rng(5)
    law = nominal()
    result = law.step(START.state)
    for k in range(200):
        A, B = DESIGN.polytope.at(START.state[0] + k, START.state[1] + 0.3 * k)
        expected = A @ result.deviation + B @ result.input
        measured = START.state + np.array([k + 1, 0.3 * (k + 1), *rng.normal(size=7)])
        result = law.step(measured)
        assert_allclose(result.deviation, expected, rtol=1e-11, atol=1e-13)
        assert_array_equal(result.reference, law.reference.final_state)


def test_tells_when_the_deviation_is_larger_than_the_design_knows():
    far = START.state.copy()
    far[2] += 0.5
    result = nominal().step(far)
    assert NominalStatus.OUTSIDE_FAMILY in result.status
    assert np.all(np.isfinite(result.input))


@pytest.mark.parametrize(("component", "value"), [(0, 30000.0), (1, 2000.0)])
def test_tells_when_the_vehicle_is_outside_the_envelope_and_holds_its_edge(component, value):
    law = nominal()
    before = law.step(START.state)
    outside = START.state.copy()
    outside[component] = value
    result = law.step(outside)
    assert NominalStatus.OUTSIDE_ENVELOPE in result.status
    assert before.status == NominalStatus.OK
    # Outside the envelope, the model of the nearest edge holds: the next deviation is the same at any distance.
    outside[component] += 1e3 * math.copysign(1.0, value - START.state[component])
    other = nominal()
    other.step(START.state)
    other.step(outside)
    assert_array_equal(law.step(START.state).deviation, other.step(START.state).deviation)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_measured_state_that_means_nothing_is_told_and_does_not_spoil_the_nominal(value):
    law = nominal()
    law.step(START.state)
    result = law.step(np.full(9, value))
    assert NominalStatus.OUTSIDE_ENVELOPE in result.status
    assert np.all(np.isfinite(result.input))
    assert np.all(np.isfinite(law.step(START.state).deviation))


@pytest.mark.parametrize(
    ("name", "value"),
    [("reference.altitudes", 30000.0), ("reference.velocities", 2484), ("reference.altitudes", math.nan)],
)
def test_a_wrong_reference_is_named(name, value):
    with pytest.raises(ParameterError, match=rf"parameter {name}\[0\] = {value}: expected double array"):
        nominal(**{name: [value]})

"""Distributions in place of numbers in a scenario."""

from statistics import NormalDist

import mpmath
import numpy as np
import pytest

from hsv.base.errors import ScenarioError
from hsv.base.files import follow_extends
from hsv.flight.distribution import KINDS, TRUNCATION, Distribution, standard_quantiles, standard_shares
from hsv.flight.scenario import scenario_at_means

INITIAL = {"altitude": "85500 ft", "velocity": "7900 ft/s"}
BASE = {"title": "Distributions", "duration": "4 s", "initial": INITIAL}


def over_base(table):
    """Return the base scenario, changed by a ``table``."""
    return BASE | table | {"initial": BASE["initial"] | table.get("initial", {})}


def test_normal_quantiles_are_those_of_the_error_function():
    shares = np.concatenate((np.linspace(0.001, 0.999, 999), [0.075, 0.0750001, 0.925, 0.5, 0.00135]))
    exact = [float(mpmath.sqrt(2) * mpmath.erfinv(2 * mpmath.mpf(float(share)) - 1)) for share in shares]
    assert standard_quantiles(shares) == pytest.approx(exact, rel=2e-15, abs=1e-16)


def test_a_normal_distribution_ends_at_three_deviations_and_has_the_moments_of_one_that_does():
    drawn = Distribution(unit="m", low=-20.0, high=40.0, kind="normal")
    shares = (np.arange(200_000) + 0.5) / 200_000
    values = drawn.quantiles(shares)
    assert drawn.quantiles(np.array([0.0, 0.5, 1.0])).tolist() == [-20.0, 10.0, 40.0]
    assert np.all(np.diff(values) >= 0.0) and values[0] > -20.0 and values[-1] < 40.0
    assert drawn.middle == 10.0 == pytest.approx(values.mean(), abs=1e-9)
    normal = NormalDist()
    cut = 2.0 * TRUNCATION * normal.pdf(TRUNCATION) / (normal.cdf(TRUNCATION) - normal.cdf(-TRUNCATION))
    assert values.std() == pytest.approx(10.0 * np.sqrt(1.0 - cut), rel=1e-5)


def test_of_whole_numbers_each_between_the_ends_is_drawn_as_often():
    drawn = Distribution(unit="1", low=1.0, high=4.0, whole=True)
    assert drawn.quantiles(np.array([0.0, 0.24, 0.26, 0.74, 0.76, 1.0])).tolist() == [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    values, counts = np.unique(drawn.quantiles(np.linspace(0.0, 1.0, 4000, endpoint=False)), return_counts=True)
    assert values.tolist() == [1.0, 2.0, 3.0, 4.0] and np.ptp(counts) <= 1
    assert drawn.middle == 2.0


CLIMB, MASS = {"altitude_change": "10 m"}, "vehicle.perturbation.mass"


@pytest.mark.parametrize(
    ("table", "field", "unit", "low", "high"),
    [
        ({"initial": {"altitude": {"uniform": ["26000 m", "26100 m"]}}}, "initial.altitude", "m", 26000.0, 26100.0),
        ({"vehicle": {"perturbation": {"mass": {"normal": ["1 %", "1 %"]}}}}, MASS, "1", -0.02, 0.04),
        ({"command": [CLIMB, CLIMB | {"start": {"uniform": ["1 s", "2 s"]}}]}, "command[1].start", "s", 1.0, 2.0),
        ({"tube": {"tau": [1.0, 1.0, {"uniform": [0.9, 1.0]}, 1.0, 1.0]}}, "tube.tau[2]", "1", 0.9, 1.0),
        ({"controller": "mine", "mine": {"time": {"uniform": ["1 min", "90 s"]}}}, "mine.time", "s", 60.0, 90.0),
        ({"controller": "mine", "mine": {"gain": {"normal": [2.0, 0.5]}}}, "mine.gain", "1", 0.5, 3.5),
        ({"link": {"command": {"delay": {"uniform": [0, 5]}}}}, "link.command.delay", "1", 0.0, 5.0),
    ],
)
def test_any_number_may_be_a_distribution_which_stands_for_its_mean(table, field, unit, low, high):
    scenario, drawn = scenario_at_means(over_base(table), "mine")
    [(found, distribution)] = drawn.items()
    assert found == field
    assert (distribution.unit, distribution.low, distribution.high) == (unit, pytest.approx(low), pytest.approx(high))
    assert distribution.kind in KINDS
    if field == "command[1].start":
        assert scenario.command[1].start == scenario.command[1].end == 1.5


@pytest.mark.parametrize(
    ("field", "given", "message"),
    [
        ("altitude", {"triangular": ["1 m", "2 m"]}, r"initial.altitude = .*expected a number or { uniform ="),
        ("altitude", {"uniform": ["26000 m"]}, r"expected uniform = \[least, largest\]"),
        ("altitude", {"uniform": ["26100 m", "26000 m"]}, "expected a least value below the largest"),
        ("altitude", {"normal": ["26000 m", "-5 m"]}, "expected a standard deviation above zero"),
        ("altitude", {"uniform": ["26000 s", "26100 m"]}, "uniform = '26000 s': wrong unit, expected a finite"),
        ("altitude", {"uniform": ["10000 m", "26000 m"]}, "expected 85000 ft to 86500 ft, the flight envelope"),
    ],
)
def test_a_malformed_distribution_is_named_with_what_was_expected(field, given, message):
    table = BASE | {"initial": {**BASE["initial"], field: given}}
    with pytest.raises(ScenarioError, match=message) as refused:
        scenario_at_means(table, "mine")
    assert str(refused.value).startswith("scenario 'mine': initial.altitude = {")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"robust_mpc": {"gain_index": {"uniform": [0.0, 1.0]}}}, "robust_mpc.gain_index = .*expected integer from 0"),
        ({"limits": {"altitude_end_error": {"uniform": ["1 m", "2 m"]}}}, "limits.altitude_end_error = .*expected a"),
        ({"controller": "mine", "mine": {"gain": {"even": [1.0, 2.0]}}}, "mine.gain = .*expected a number or {"),
        ({"controller": "mine", "mine": {"time": {"uniform": ["1 s", "2 m"]}}}, "mine.time = .*uniform = '2 m':"),
    ],
)
def test_where_no_number_stands_there_is_no_distribution(table, message):
    with pytest.raises(ScenarioError, match=message):
        scenario_at_means(over_base(table), "mine")


def test_an_inherited_distribution_is_replaced_whole():
    files = {
        "base": {"x": {"a": {"uniform": [0, 1]}, "b": {"uniform": [0, 1]}, "c": {"uniform": [0, 1]}}},
        "own": {"extends": "base", "x": {"a": {"normal": [0, 1]}, "b": 3}},
    }
    merged = follow_extends("own", files.__getitem__, lambda name, why: ScenarioError(why), values=KINDS)
    assert merged == {"x": {"a": {"normal": [0, 1]}, "b": 3, "c": {"uniform": [0, 1]}}}


def test_shares_of_the_normal_distribution_are_those_of_mpmath():
    x = np.linspace(-8.0, 8.0, 161)
    exact = [float(mpmath.ncdf(each)) for each in x.tolist()]
    np.testing.assert_allclose(standard_shares(x), exact, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(standard_quantiles(standard_shares(x[40:121])), x[40:121], atol=1e-11)

"""Bounds at limited rates: slopes contain every slope, no slow flight exceeds the bounds, and they are recomputed."""

import copy
import dataclasses

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.certificate.checks import Subject
from hsv.certificate.convolution import _slopes, rated_bounds
from hsv.certificate.verification import rated_checks, set_checks
from hsv.control.design_file import find_design
from hsv.design.certified import load_certified
from hsv.design.tightening import tighten
from hsv.model.lpv.polytope import evaluate

FOOT = 0.3048
RATES = np.array([100.0, 30.0]) * FOOT
ROWS = [3, 6]  # pitch angle and elevator, the rows that matter most


@pytest.fixture(scope="module")
def tight():
    return load_certified(find_design("tight"))


@pytest.fixture(scope="module")
def found(tight):
    return tight.invariant_set()


@pytest.fixture(scope="module")
def loops(found):
    return np.concatenate((found.problem.system.A, found.problem.columns(found.centre)), axis=2)


@pytest.fixture(scope="module")
def bounds(tight, found, loops):
    stacks = [[found.Q[None], found.star_norms.Q[k]] for k in ROWS]
    rows = found.problem.output_rows()[ROWS]
    changes = RATES * tight.design.period
    return rated_bounds(tight.design.polytope, loops, found.centre, rows, stacks, changes, [250, 570])[0]


def scheduled(polytope, loops, points):
    """Return [A, C] (k, n, n + d) at points (k, 2)."""
    h, v = evaluate(polytope.altitude, points[:, 0]), evaluate(polytope.velocity, points[:, 1])
    weights = (h[:, :, None] * v[:, None, :]).reshape(len(points), -1)
    return np.tensordot(weights, loops, 1)


def test_published_bounds(found, bounds):
    """The elevator feedback of docs/certified_bounds.md: 5.8 deg in place of 11.8; pitch angle 0.84 deg."""
    assert np.degrees(bounds) == pytest.approx([0.837, 5.82], abs=0.01)
    assert bounds[1] < 0.5 * found.feedback[1]


def test_slopes_contain_the_slope_at_any_point(tight, loops):
    """No linear function of a slope exceeds its largest value over the box; some slopes almost attain it."""
    polytope, draw = tight.design.polytope, np.random.default_rng(2)
    spans = [axis.breakpoints[[0, -1]] for axis in (polytope.altitude, polytope.velocity)]
    functions = draw.standard_normal((300, loops[0].size)) / np.abs(loops).mean(axis=0).ravel().clip(1e-12)
    for axis, slopes in enumerate(_slopes(polytope, loops)):
        low = np.column_stack([draw.uniform(*span, size=300) for span in spans])
        high = low.copy()
        high[:, axis] += 1e-3 * np.ptp(spans[axis]) * draw.uniform(size=300)
        change = scheduled(polytope, loops, high) - scheduled(polytope, loops, low)
        found = (change.reshape(300, -1) @ functions.T) / (high - low)[:, [axis]]
        largest = np.abs(slopes.reshape(len(slopes), -1) @ functions.T).sum(axis=0)
        assert 0.9 < (np.abs(found) / largest).max() <= 1.0 + 1e-6


def test_no_slow_flight_exceeds_the_bounds(tight, found, loops, bounds):
    """Altitude and velocity move at their largest rates and turn at random; the disturbances are the worst ones."""
    polytope, n, draw = tight.design.polytope, len(found.centre), np.random.default_rng(3)
    spans = np.array([axis.breakpoints[[0, -1]] for axis in (polytope.altitude, polytope.velocity)])
    largest = np.zeros(len(ROWS))
    for _ in range(12):
        m = int(draw.integers(1, 1500))
        turns = np.repeat(draw.choice((-1.0, 0.0, 1.0), size=(m // 50 + 1, 2)), 50, axis=0)[:m]
        points = [draw.uniform(*spans.T)]
        for turn in turns[1:]:
            points.append(np.clip(points[-1] + turn * RATES * tight.design.period, *spans.T))
        models = scheduled(polytope, loops, np.array(points))
        for k, row in enumerate(found.problem.output_rows()[ROWS]):
            driven = drift = 0.0
            for model in models[::-1]:
                driven += np.abs(row @ model[:, n:-1]).sum()
                drift += row @ model[:, -1]
                row = row @ model[:, :n]
            largest[k] = max(largest[k], driven + abs(drift - row @ found.centre))
    assert np.all(largest <= bounds) and np.all(largest > 0.5 * bounds)


def with_rates(subject):
    """Return ``subject`` with bounds at limited rates, as ``hsv design`` writes them."""
    found = subject.invariant_set().limited(subject.design, RATES)
    certificate = copy.deepcopy(subject.certificate)
    bounds = tighten(found, subject.design.input_minimum, subject.design.input_maximum)
    certificate["inputs"]["invariant_set"]["rates"] = {"altitude": RATES[0], "velocity": RATES[1]}
    certificate["tube"]["invariant_set"] |= {
        "half_width": found.half_width.tolist(),
        "feedback_half_range": found.feedback.tolist(),
        "rated": found.rated.as_dict(),
    }
    certificate["tube"]["tightening"] |= {"lower": bounds.lower.tolist(), "upper": bounds.upper.tolist()}
    plan_bounds = dataclasses.replace(
        subject.design.plan_bounds, input_minimum=bounds.lower, input_maximum=bounds.upper
    )
    design = dataclasses.replace(subject.design, tube=found.seen(), plan_bounds=plan_bounds)
    return Subject(type(design).from_parameters(design.to_parameters()), certificate)


@pytest.mark.long
def test_the_bounds_are_recomputed(tight):
    subject = with_rates(tight)
    assert subject.design.tube.rates == pytest.approx(RATES)
    assert all(check.ok for check in rated_checks(subject))
    allowed = ("plan", "nominal")  # the margins of the plan and its region are those of the shipped design
    failing = [check.name for check in set_checks(subject) if not check.ok]
    assert [name for name in failing if not any(word in name for word in allowed)] == []
    # A smaller bound, other rates, and a design that is monitored for other rates are noticed.
    stated = subject.certificate["tube"]["invariant_set"]["rated"]
    stated["half_range"][6] *= 1.0 - 1e-6
    assert any("half_range" in check.name and check.required for check in rated_checks(subject) if not check.ok)
    stated["half_range"][6] /= 1.0 - 1e-6
    subject.certificate["inputs"]["invariant_set"]["rates"]["velocity"] *= 2.0
    changed = next(check for check in rated_checks(subject) if not check.ok)
    assert changed.name.startswith("tube.invariant_set.rated.rates")
    assert any("tube.rates" in check.name and check.required for check in set_checks(subject) if not check.ok)


def test_an_adjustable_design_has_no_bounds_at_limited_rates():
    subject = load_certified(find_design("adjustable"))
    with pytest.raises(DesignError, match="expected a design that is not adjustable"):
        subject.invariant_set().limited(subject.design, RATES)

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.control.design import find_design
from hsv.design.certified import load_certified
from hsv.design.hardware import verdict


def test_where_no_set_is_found_the_reason_is_that_of_the_search(subject, monkeypatch):
    def none(*_):
        raise DesignError("no set")

    monkeypatch.setattr(verdict, "invariant_set", none)
    assert verdict.verdict("x", subject.design, subject).said() == "no set"


@pytest.mark.long
def test_a_design_that_knows_actuators_is_judged_with_those_that_fly(realistic):
    tube = realistic.certificate["tube"]
    known, ideal = verdict.certified_with(realistic, {}, "ideal")
    assert (known.name, ideal.name) == ("as certified", "ideal actuators")
    assert np.allclose(known.half_width, tube["invariant_set"]["half_width"][:5], rtol=1e-5)
    # No lag: a smaller set, less feedback, more room, and no limits to say anything about.
    assert np.all(ideal.half_width < known.half_width) and np.all(ideal.feedback < known.feedback)
    assert ideal.shares.min() > known.shares.min() and not ideal.reaches


def test_a_flight_may_start_where_both_ellipsoid_and_star_norms_allow_it():
    found = load_certified(find_design("tight")).invariant_set()
    at_rest = np.zeros(5)
    norms = found.star_norms.level_at_start(found.problem, found.centre)
    assert verdict._start(found, at_rest) == max(norms, found.level(np.zeros(len(found.centre))))
    # Such an error of the pitch angle is inside the ellipsoid; for star norms it is too far, if one channel takes it.
    error = np.array([0.0, 0.0, 0.0, 0.1 * found.half_width[3], 0.0])
    assert max(found.level(side * np.append(error, [0.0, 0.0])) for side in (1.0, -1.0)) < 1.0
    assert verdict._start(found, error) > 1.0


@pytest.mark.long
def test_the_set_found_anew_is_that_of_the_certificate():
    tight = load_certified(find_design("tight"))
    (known,) = verdict.certified_with(tight, {})
    assert known.certified and known.start <= 1.0
    stated = tight.certificate["tube"]["invariant_set"]
    assert np.allclose(known.half_width, stated["half_width"][:5], rtol=1e-5)
    assert np.allclose(known.feedback, stated["feedback_half_range"] + _feedthrough(tight), rtol=1e-5)


def _feedthrough(subject):
    """Return the half-range (2) of the feedback to the filtered nominal pitch rate."""
    problem = subject.invariant_set().problem
    return np.abs(problem.system.F_d) @ problem.disturbance.half_width

import numpy as np

from hsv.design.verification import verdict
from hsv.errors import DesignError


def test_where_no_set_is_found_the_reason_is_that_of_the_search(subject, monkeypatch):
    def none(*_):
        raise DesignError("no set")

    monkeypatch.setattr(verdict, "ellipsoid_set", none)
    assert verdict.verdict("x", subject.design, subject).said() == "no set"


def test_a_design_that_knows_actuators_is_judged_with_those_that_fly(realistic):
    tube = realistic.certificate["tube"]
    known, ideal = verdict.certified_with(realistic, {}, "ideal")
    assert (known.name, ideal.name) == ("as certified", "ideal actuators")
    assert np.allclose(known.half_width, tube["invariant_set"]["half_width"][:5], rtol=1e-5)
    # No lag: a smaller set, less feedback, more room, and no limits to say anything about.
    assert np.all(ideal.half_width < known.half_width) and np.all(ideal.feedback < known.feedback)
    assert ideal.shares.min() > known.shares.min() and not ideal.reaches

"""Star norms and counter-examples: upper bounds by row and channel, and a lower limit of any such bound."""

import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.control.design_file import find_design
from hsv.design.certified import load_certified
from hsv.design.sets.counter_example import counter_examples
from hsv.design.sets.star_norms import StarNorms, star_norms


@pytest.fixture(scope="module")
def tight():
    """Return the invariant set of the shipped design ``tight``, which star norms reduce."""
    return load_certified(find_design("tight")).invariant_set()


def test_published_bounds(tight):
    """Values of docs/certified_bounds.md: the pitch angle is certified within 1 deg, of which 85 % are attained."""
    driven = load_certified(find_design("tight")).stated("tube.invariant_set.counter_examples.half_range")
    assert np.degrees([tight.half_width[3], driven[3]]) == pytest.approx([0.906, 0.772], abs=0.001)
    certified = load_certified(find_design("derived"))
    derived, driven = certified.invariant_set(), certified.stated("tube.invariant_set.counter_examples.half_range")
    assert np.degrees([derived.feedback[1], driven[6]]) == pytest.approx([13.7, 9.92], abs=0.05)
    assert driven[3] > 0.8 * derived.half_width[3]


def test_no_sequence_leaves_the_bounds(tight):
    """Vertices and disturbances change at random; some are held for long, which excites slow poles most."""
    rng = np.random.default_rng(5)
    system, w = tight.problem.system, tight.problem.disturbance
    rows, bounds = tight.problem.output_rows(), tight.star_norms.bounds(tight.problem)
    errors, worst = np.zeros((400, len(tight.centre))), 0.0
    hold = rng.integers(1, 100, size=400)
    vertices, signs = rng.integers(len(system.A), size=400), rng.integers(2, size=(400, 7))
    for step in range(600):
        change = step % hold == 0
        vertices = np.where(change, rng.integers(len(system.A), size=400), vertices)
        signs = np.where(change[:, None], rng.integers(2, size=(400, 7)), signs)
        d = w.lower + signs * (w.upper - w.lower)
        errors = np.einsum("kij,kj->ki", system.A[vertices], errors) + np.einsum("kij,kj->ki", system.G[vertices], d)
        worst = max(worst, float(np.max(np.abs((errors - tight.centre) @ rows.T) / bounds)))
    assert 0.2 < worst <= 1.0


def test_certificate_holds_and_fails_just_beyond(tight):
    evidence = tight.certify()["star_norms"]
    assert evidence["smallest_eigenvalue"] > 0.0 and evidence["level_of_zero_error"] <= 1.0
    Q = tight.star_norms.Q.copy()
    Q[3, 1] *= 0.99
    smaller = dataclasses.replace(tight, star_norms=StarNorms(Q, tight.star_norms.contraction))
    with pytest.raises(DesignError, match="inequality of row 3, channel 1"):
        smaller.certify()
    Q[3, 1] = 0.0
    with pytest.raises(DesignError, match=r"Q\[3, 1\] is not positive definite"):
        smaller.certify()


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda norms: norms["contraction"].pop(), r"contraction: expected finite numbers of shape \(7, 8\)"),
        (lambda norms: norms["Q"][3][1].pop(), r"Q: expected finite numbers of shape \(7, 8, 7, 7\)"),
        (lambda norms: norms["Q"][6][1][0].__setitem__(3, 0.0), "Q: expected symmetric matrices"),
    ],
)
def test_what_is_checked_is_what_bounds(tight, change, named):
    """Without one contraction, an ellipsoid would go unchecked; a factorisation reads only one triangle."""
    report = tight.star_norms.as_dict()
    change(report)
    with pytest.raises(DesignError, match=f"star_norms.{named}"):
        StarNorms.from_report(report, tight.problem)


@pytest.mark.long
def test_star_norms_lie_between_the_ellipsoid_and_the_counter_examples(found):
    narrowed = replace(found, star_norms=star_norms(found.problem, found.centre))
    narrowed.certify()
    driven = counter_examples(found.problem).half_range
    rows = [np.append(each.half_width[:5], each.feedback) for each in (found, narrowed)]
    assert np.all(rows[1] <= rows[0]) and np.all(driven < rows[1])
    # Half-widths of the pitch angle in docs/gap.md.
    assert np.degrees([row[3] for row in (*rows, driven)]) == pytest.approx([1.92, 1.76, 1.48], abs=0.015)

import numpy as np
import pytest

from hsv.design.compare import compare_sets


@pytest.mark.long
def test_star_norms_lie_between_the_ellipsoid_and_the_counter_examples(found, subject):
    inputs = subject.inputs.invariant_set.model_copy(update={"contraction": [found.contraction]})
    rows = compare_sets(subject.design, found.problem, inputs)
    assert [row.name for row in rows] == ["ellipsoid", "star norms", "counter-examples"]
    ellipsoid, narrowed, driven = rows
    assert ellipsoid.size > narrowed.size > driven.size
    assert np.all(narrowed.feedback <= ellipsoid.feedback) and np.all(driven.feedback < narrowed.feedback)
    # docs/certified_bounds.md: half-widths of the pitch angle.
    assert np.degrees([row.half_width[3] for row in rows]) == pytest.approx([1.92, 1.76, 1.48], abs=0.01)

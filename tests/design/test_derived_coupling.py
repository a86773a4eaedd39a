"""The linear loop behind docs/derived_coupling.md: what the notch at 15 rad/s does to one corner of the parameters."""

import numpy as np
import pytest

from hsv.control.design import find_design, read_design
from hsv.flight.corners import corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import Feedback

WORST = 764
"""Index of the corner with the least moment of inertia, the largest mass and the strongest elevator."""


def elastic_damping(name, corner, coupling="derived", effectiveness=1.0):
    """Return the largest real part (1/s) of the elastic modes of the sampled loop where Case 1 ends."""
    design = read_design(find_design(name))
    vehicle = load_vehicle().coupled(coupling).perturbed(corner)
    loop = Feedback.of(design).around(vehicle, effectiveness=effectiveness)
    return loop.poles[np.abs(loop.poles.imag) > 8.0].real.max()


def test_the_baseline_s_notch_leaves_a_corner_of_the_derived_coupling_without_damping():
    corner = corners(load_vehicle().uncertainty)[WORST]
    signs = {name: np.sign(change) for name, change in corner.items()}
    assert (signs["moment_of_inertia"], signs["mass"], signs["moment_elevator"]) == (-1.0, 1.0, 1.0)
    assert elastic_damping("baseline", corner) == pytest.approx(0.034, abs=2e-3)
    assert elastic_damping("baseline", corner, effectiveness=0.9) == pytest.approx(-0.083, abs=2e-3)
    assert elastic_damping("baseline", {}) == pytest.approx(-0.204, abs=2e-3)
    assert elastic_damping("baseline", corner, "paper_like") < -0.28


def test_two_designs_have_the_same_gains():
    baseline, derived = read_design(find_design("baseline")), read_design(find_design("baseline_derived"))
    assert np.array_equal(baseline.feedback_gain, derived.feedback_gain)
    assert np.array_equal(baseline.nominal_gains, derived.nominal_gains)
    assert (baseline.coupling, derived.coupling) == ("paper_like", "derived")

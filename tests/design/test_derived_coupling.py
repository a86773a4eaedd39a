"""The linear loop behind docs/derived_coupling.md: the notch at 15 rad/s at one corner of the parameters."""

import numpy as np
import pytest

from hsv.certificate.loops import Feedback
from hsv.control.design_file import find_design, read_design
from hsv.flight.corners import corners
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import TARGET


def elastic_damping(name, corner, coupling="derived", effectiveness=1.0):
    """Return the largest real part (1/s) of the elastic modes of the sampled loop at the end of Case 1."""
    vehicle = load_vehicle().coupled(coupling).perturbed(corner)
    poles = Feedback.of(read_design(find_design(name))).around(vehicle, TARGET, effectiveness).poles
    return poles[np.abs(poles.imag) > 8.0].real.max()


def test_the_baseline_s_notch_leaves_a_corner_of_the_derived_coupling_without_damping():
    # The corner with the smallest moment of inertia, the largest mass and the most effective elevator.
    corner = corners(load_vehicle().uncertainty)[764]
    assert elastic_damping("baseline", corner) == pytest.approx(0.034, abs=2e-3)
    assert elastic_damping("baseline", corner, effectiveness=0.9) == pytest.approx(-0.083, abs=2e-3)
    assert elastic_damping("baseline", {}) == pytest.approx(-0.204, abs=2e-3)
    assert elastic_damping("baseline_derived", corner) < -0.17

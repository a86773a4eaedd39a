from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hsv.model.lpv.linearisation import grid_polytope, linearise, zero_order_hold
from hsv.model.vehicle import load_vehicle

ALTITUDES = np.linspace(*load_vehicle().altitude_range, 4)
VELOCITIES = np.linspace(*load_vehicle().velocity_range, 5)


@pytest.fixture(scope="module")
def polytope():
    return grid_polytope(partial(linearise, load_vehicle().coupled()), ALTITUDES, VELOCITIES, 0.02)


def test_model_at_a_node_is_the_vertex(polytope):
    for i, j in ((0, 0), (1, 3), (3, 4)):
        A, B = polytope.at(ALTITUDES[i], VELOCITIES[j])
        expected_A, expected_B = zero_order_hold(
            *linearise(load_vehicle().coupled(), ALTITUDES[i], VELOCITIES[j]), 0.02
        )
        assert_allclose(A, expected_A, rtol=1e-13, atol=1e-16)
        assert_allclose(B, expected_B, rtol=1e-13, atol=1e-16)


def test_interpolation_error_between_nodes_is_small(polytope):
    h, v = 0.5 * (ALTITUDES[1] + ALTITUDES[2]), 0.5 * (VELOCITIES[2] + VELOCITIES[3])
    A, _ = polytope.at(h, v)
    exact, _ = zero_order_hold(*linearise(load_vehicle().coupled(), h, v), 0.02)
    assert np.abs(A - exact).max() < 1e-3 * np.abs(exact - np.eye(9)).max()


def test_linearisation_has_the_structural_modes_and_no_inertial_coupling():
    A, _ = linearise(load_vehicle().coupled("derived"), 25908.0, 2347.594)
    assert_array_equal(A[:5, 5:], 0.0)
    modes = np.linalg.eigvals(A[5:, 5:])
    assert_allclose(np.sort(np.abs(modes)), [16.02, 16.02, 19.58, 19.58], rtol=1e-12)
    # Control study, section 1: the unstable pole over the envelope.
    assert 1.65 < np.linalg.eigvals(A).real.max() < 1.80

"""Numbers behind the claims: sets, levels, disturbances, and peaks of the modes."""

import numpy as np
import pytest

from hsv.control.notch_filter import NotchSection
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.numbers import box, kept_of_level, largest_disturbances
from hsv_paper.designs import certificate, design
from hsv_paper.modes import elastic_modes, peak_falls, peaks


def test_no_box_exists_for_the_baseline():
    assert box(Evidence(over=[{}]))["radius"] == pytest.approx(1.296, abs=1e-3)
    flown = design("baseline")
    radii = np.abs(np.linalg.eigvals(np.abs(flown.polytope.A + flown.polytope.B @ flown.feedback_gain))).max(axis=1)
    assert radii.max() > 1.0


def test_what_loses_a_step_s_share_of_its_level_decreases():
    A = np.array([[[0.5, 0.0], [0.0, 0.5]], [[0.0, 0.9], [0.0, 0.0]]])
    B = np.zeros((2, 2, 1))
    assert kept_of_level(A, B, np.zeros((1, 2)), np.eye(2)) == pytest.approx(0.81)
    # With another shape matrix the same map grows: the shape decides, not only the poles.
    assert kept_of_level(A, B, np.zeros((1, 2)), np.diag([4.0, 1.0])) > 1.0


def test_disturbances_of_a_flight_lie_in_the_set_that_was_certified():
    bounds = certificate("baseline")["tube"]["disturbance"]["channels"]
    found = largest_disturbances("case1", [{}, {"mass": 0.1, "moment_of_inertia": -0.1}])
    assert found.keys() == bounds.keys()
    for name, values in found.items():
        assert np.all(values <= max(-bounds[name]["lower"], bounds[name]["upper"]))


def test_the_fall_is_from_peak_to_peak_though_the_peak_moves():
    section = NotchSection(15.0, 0.02, 15.0, 0.5)
    before, after = peaks(()), peaks([section])
    assert (before["first"].frequency, after["first"].frequency) == pytest.approx((15.64, 15.86), abs=0.01)
    assert peak_falls([section]) == pytest.approx({"first": 19.4, "second": 6.7}, abs=0.05)
    frequencies = [mode.natural_frequency for mode in elastic_modes("paper_like").values()]
    assert frequencies == pytest.approx([15.89, 19.47], abs=0.01)

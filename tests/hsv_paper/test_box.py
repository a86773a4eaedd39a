import numpy as np
import pytest

from hsv.control.checks import load_subject
from hsv.control.design import find_design
from hsv_paper.box import infeasibility


def test_no_box_exists_for_the_baseline():
    subject = load_subject(find_design("baseline"))
    polytope, delta = subject.design.polytope, subject.stated("tube.disturbance.boxes.delta")
    closed = polytope.A + polytope.B @ subject.design.feedback_gain
    proof = infeasibility(closed, 0.5 * np.subtract(delta["upper"], delta["lower"]))
    assert proof.multipliers.min() >= 0.0 and proof.gain > 0.0
    assert proof.column <= 1e-9
    assert proof.radius == pytest.approx(1.296, abs=1e-3)


def test_where_absolute_values_contract_nothing_is_proved():
    assert infeasibility(np.array([[[0.5, 0.2], [-0.1, 0.6]]]), np.ones(2)).column > 0.1

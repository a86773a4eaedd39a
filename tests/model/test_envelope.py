"""The range of the model: finite states, angles within those of the curve fits, a vehicle that flies forward."""

import numpy as np
import pytest

from hsv.base.units import FOOT
from hsv.model.dynamics import in_model_range

ANGLE_LIMIT = 0.35
CRUISE = np.array([85_500.0 * FOOT, 7_900.0 * FOOT, 0.03, 0.03, 0.0, 0.1, 0.0, 0.1, 0.0])
"""A state of Case 1, SI."""


@pytest.mark.parametrize(
    ("index", "value", "inside"),
    [
        (2, -0.36, False),
        (3, 0.36, False),
        (1, 0.0, False),
        (8, np.nan, False),
        (0, np.inf, False),
    ],
)
def test_states_in_and_out_of_the_range_of_the_model(index: int, value: float, inside: bool) -> None:
    state = CRUISE.copy()
    state[index] = value
    assert bool(in_model_range(state, ANGLE_LIMIT)) is inside

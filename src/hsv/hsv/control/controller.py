"""What a controller is: what it is given in a step and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np


class ControllerInput(NamedTuple):
    """What a controller is given in a step, SI units and radians."""

    step: int
    """k, from 0 on; t = k T"""
    state: np.ndarray
    """x (9), measured, with the unfiltered pitch rate"""
    filtered_pitch_rate: float
    """q_f, rad/s"""
    filter_state: np.ndarray
    """s (2 s) of the notch filter before its update, two a section; empty without a notch filter"""
    reference: np.ndarray
    """x_r (9)"""
    reference_input: np.ndarray
    """u_r (2)"""
    deviation: np.ndarray
    """x_n (9)"""
    nominal_input: np.ndarray
    """u_n (2)"""


@dataclass(frozen=True)
class ControllerResult:
    """What a controller answers; a controller with diagnostics returns more, see :mod:`hsv.control.tube_law`."""

    input: np.ndarray
    """u (2), within the limits"""
    u_unsaturated: np.ndarray
    """(2) before the limits"""


class Controller(Protocol):
    """From measured, reference and nominal state to the input of a step."""

    def reset(self) -> None:
        """Start a new run."""

    def step(self, inputs: ControllerInput) -> ControllerResult:
        """Return the input of this step; called once a step, in order."""

"""The invariant set of the tube in flight: where the error is in it, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.model.dynamics import N_RIGID, STATE_NAMES


@dataclass(frozen=True)
class TubeSet:
    """c + {v: v' P v <= 1} for errors of the rigid states and the notch filter (n), SI.

    ``centre`` c (n), ``shape`` P (n, n), ``half_width`` z (n) of the box around it.
    """

    centre: np.ndarray
    shape: np.ndarray
    half_width: np.ndarray

    def farthest(self, error: np.ndarray) -> str:
        """Return the name of the component of e - c that is largest for its half-width."""
        index = int(np.argmax(np.abs(error - self.centre) / self.half_width))
        return STATE_NAMES[index] if index < N_RIGID else f"filter_{index - N_RIGID + 1}"

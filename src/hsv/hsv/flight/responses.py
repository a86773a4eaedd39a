"""Linear responses along a flight: of the notch filter, and of the error to the lag of the plan."""

from __future__ import annotations

import numpy as np

from hsv.core import Struct, doubles, lib, vector
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_INPUTS, N_RIGID


def along_filter(notch: Struct, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``rate`` (k) filtered, from rest for its first value, and the filter's states (k, s) before each step."""
    filtered, states = np.empty(len(rate)), np.empty((len(rate), 2 * len(notch.D)))
    lib.hsv_notch_along(notch.pointer, len(rate), *map(doubles, (vector(rate), filtered, states)))
    return filtered, states


def lag_response(
    polytope: Polytope,
    gain: np.ndarray,
    notch: Struct,
    actuators: Struct,
    scheduled: np.ndarray,
    lag: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the effect of the plan's lag on e (k, n) and on the feedback (k, 2), in closed loop, from zero.

    ``gain`` (2, 5): F, with its factor; ``scheduled`` (k, 2): altitude and velocity of the flight; ``lag`` (k, 2): mean
    position of actuators driven by the plan, less the plan.
    """
    a, s, data = len(actuators.A), 2 * len(notch.D), polytope.data()
    errors, feedback = np.empty((len(lag), N_RIGID + s + a)), np.empty((len(lag), N_INPUTS))
    lib.hsv_lag_response(
        data.pointer,
        doubles(vector(gain)),
        notch.pointer,
        actuators.pointer,
        len(lag),
        *(doubles(vector(each)) for each in (scheduled, lag, errors, feedback)),
    )
    return errors, feedback

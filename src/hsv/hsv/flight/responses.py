"""Linear responses along a flight: of the notch filter, and of the tube error to the lag of the actuators."""

from __future__ import annotations

import numpy as np

from hsv.core import Struct, doubles, lib, vector
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_INPUTS, N_RIGID


def along_filter(notch: Struct, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the output of the notch filter for the pitch ``rate``, both of shape (k,), and its states, shape (k, s).

    The filter starts at the equilibrium for the first rate. Row i has the s states, two per section, before step i.
    """
    filtered, states = np.empty(len(rate)), np.empty((len(rate), 2 * len(notch.D)))
    lib.hsv_notch_along(notch.pointer, len(rate), *map(doubles, (vector(rate), filtered, states)))
    return filtered, states


def lag_response(
    polytope: Polytope, gain: np.ndarray, notch: Struct, actuators: Struct, scheduled: np.ndarray, lag: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the closed loop's responses to ``lag``: the error e, shape (k, n), and the feedback to it, shape (k, 2).

    The error starts at zero. Its n states are those of the rigid body (five), the notch filter and the actuators.

    Args:
        polytope: Model of the vehicle.
        gain: (2, 5) feedback gain, tau F.
        notch: Notch filter.
        actuators: Sampled actuators.
        scheduled: (k, 2) altitude (m) and velocity (m/s) of the flight.
        lag: (k, 2) lag of actuators driven by the plan u_r + u_n: their mean positions in each step, minus the plan.
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

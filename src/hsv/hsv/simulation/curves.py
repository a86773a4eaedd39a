"""What the metrics read of a flight, compiled."""

from __future__ import annotations

import math

import numpy as np

from hsv.compiled import njit, njit_in_flight
from hsv.simulation.metrics import SETTLING_BAND


@njit_in_flight(nogil=True)
def read_flight(
    state: np.ndarray,
    reference: np.ndarray,
    deviation: np.ndarray,
    command: np.ndarray,
    unlimited: np.ndarray,
    curves: np.ndarray,
    saturated: np.ndarray,
) -> None:
    """Write ``curves`` and ``saturated`` of a :class:`hsv.simulation.metrics.FlightCurves`, or of some of its rows.

    In one pass: rows are wider than a line of a cache, and a cache near the processor does not hold a flight.
    """
    for k in range(len(state)):
        curves[0, k] = state[k, 0] - reference[k, 0]
        curves[1, k] = state[k, 1] - reference[k, 1]
        curves[2, k], curves[3, k] = state[k, 2], state[k, 3]
        curves[4, k], curves[5, k] = state[k, 6], state[k, 8]
        curves[6, k], curves[7, k] = command[k, 0], command[k, 1]
        curves[8, k] = abs(state[k, 2] - reference[k, 2] - deviation[k, 2])
        curves[9, k] = abs(state[k, 3] - reference[k, 3] - deviation[k, 3])
        saturated[k, 0], saturated[k, 1] = command[k, 0] != unlimited[k, 0], command[k, 1] != unlimited[k, 1]


@njit_in_flight(nogil=True)
def integrate(values: np.ndarray, time: np.ndarray, magnitudes: np.ndarray, integrals: np.ndarray) -> None:
    """Write magnitudes of ``values`` (n + 1), and their integrals (n) from each time to the next by trapezoids."""
    for k in range(len(values)):
        magnitudes[k] = abs(values[k])
    for k in range(len(integrals)):
        integrals[k] = 0.5 * (magnitudes[k + 1] + magnitudes[k]) * (time[k + 1] - time[k])


@njit(cache=True, nogil=True, error_model="numpy")
def step_marks(error: np.ndarray) -> tuple[float, int, int, int]:
    """Return the largest share of a step that is done, and three rows, -1 where there is none.

    Those in which 10 % and 90 % are done first, and in which it is outside the settling band last. The share is not a
    number where that of any row is none.
    """
    most, begun, risen, off = -np.inf, -1, -1, -1
    for k in range(len(error)):
        done = 1.0 - error[k] / error[0]
        if not done <= most and not math.isnan(most):
            most = done
        if begun < 0 and done >= 0.1:
            begun = k
        if risen < 0 and done >= 0.9:
            risen = k
        if abs(done - 1.0) > SETTLING_BAND:
            off = k
    return most, begun, risen, off

"""Classical Runge-Kutta integration of the equations of motion over one control period, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.vehicle.dynamics import N_STATES, derivative


def workspace() -> np.ndarray:
    """Return the scratch array (3, 9) that :func:`advance` wants, so that stepping allocates nothing."""
    return np.empty((3, N_STATES))


@njit_in_flight(error_model="numpy")
def advance(x: Any, u: Any, p: Any, period: float, substeps: int, work: Any, conditions: Any = None) -> None:
    """Replace ``x`` (9) by the state one ``period`` (s) later, input ``u`` (2) held, by ``substeps`` steps of RK4.

    So are the ``conditions`` (7) of :func:`hsv.vehicle.dynamics.forces_in`, where there are any.
    """
    h = period / substeps
    slope, point, total = work[0], work[1], work[2]
    for _ in range(substeps):
        for i in range(N_STATES):
            point[i] = x[i]
        # One call in a loop: the derivative is compiled into it, four copies would take four times as long to compile.
        for stage in range(4):
            derivative(point, u, p, slope, conditions)
            reach = h if stage == 2 else 0.5 * h
            for i in range(N_STATES):
                total[i] = slope[i] if stage == 0 else total[i] + (2.0 * slope[i] if stage < 3 else slope[i])
                point[i] = x[i] + reach * slope[i]
        for i in range(N_STATES):
            x[i] += h / 6.0 * total[i]

"""Numbers of a flight that the claims are judged by, beside the metrics of every flight; SI."""

from __future__ import annotations

import numpy as np

from hsv.simulation.metrics import FlightData, flight_metrics

AFTER = 20.0
"""Seconds after the fault over which errors are averaged."""

RINGING = (10.0, 20.0)
"""Seconds after the fault between which what still moves is vibration."""

SETTLED = 1e-3
"""rad: an angle this close to its last value has settled."""


def flight_measures(flight: FlightData, half_width: np.ndarray) -> dict[str, float]:
    """Return the metrics of a flight with those of the study; what it does not define is left out.

    Args:
        flight: Flown to its end or not.
        half_width: (5) errors of the rigid states that count as equal.
    """
    values = flight_metrics(flight)
    deviation = np.abs(flight.state - flight.reference)
    values["attitude_from_reference"] = float(deviation[:, 2:4].max())
    if flight.fault_start is None or flight.time[-1] < flight.fault_start + AFTER:
        return values
    since = flight.time - flight.fault_start
    after, window = since >= 0.0, (since >= 0.0) & (since <= AFTER)
    ringing = (since >= RINGING[0]) & (since <= RINGING[1])
    error = (flight.state - flight.reference - flight.deviation)[window, :5]
    values["post_fault_altitude_error"] = float(deviation[after, 0].max())
    values["rigid_error"] = float(np.sqrt(np.mean((error / half_width) ** 2)))
    values["pitch_rate_error"] = float(np.sqrt(np.mean(error[:, 4] ** 2)))
    values["pitch_rate_ringing"] = float(np.ptp(flight.state[ringing, 4]))
    for mode, column in ((1, 5), (2, 7)):
        values[f"elastic_coordinate_{mode}_span"] = float(np.ptp(flight.state[after, column]))
        values[f"elastic_rate_{mode}_span"] = float(np.ptp(flight.state[after, column + 1]))
        values[f"elastic_rate_{mode}_ringing"] = float(np.ptp(flight.state[ringing, column + 1]))
    attitude = np.abs(flight.state[after, 2:4] - flight.state[-1, 2:4]).max(axis=1)
    moving = np.flatnonzero(attitude > SETTLED)
    values["attitude_settling_time"] = float(since[after][moving[-1]]) if len(moving) else 0.0
    return values

"""Numbers of a flight that the claims are judged by, beside the metrics of every flight; SI."""

from __future__ import annotations

import numpy as np

from hsv.flight.metrics import FlightData, flight_metrics

AFTER = 20.0
"""Seconds after the fault over which errors are averaged."""

RINGING = (10.0, 20.0)
"""Seconds after the fault between which what still moves is vibration."""

SETTLED = 0.05
"""Share of its largest distance from its last value within which an angle or the pitch rate counts as settled."""

LAST = 1.0
"""Seconds before the end, some periods of both modes: a rate above its decay level in them has not decayed."""


def flight_measures(flight: FlightData, half_width: np.ndarray) -> dict[str, float]:
    """Return the metrics of a flight with those of the study; undefined ones are omitted.

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
    values["attitude_settling_time"] = _settling_time(since[after], flight.state[after, 2:4])
    values["pitch_rate_settling_time"] = _settling_time(since[after], flight.state[after, 4:5])
    for name in ("elastic_rate_1", "elastic_rate_2", "elastic"):
        decay = values[f"{name}_decay_time"]
        values[f"{name}_settling_time"] = decay if decay < since[-1] - LAST else np.inf
    return values


def _settling_time(time: np.ndarray, states: np.ndarray) -> float:
    """Return the last time (n) at which one of the states (n, m) is farther from its end than it may be."""
    distance = np.abs(states - states[-1])
    moving = np.flatnonzero(np.any(distance > SETTLED * distance.max(axis=0), axis=1))
    return float(time[moving[-1]]) if len(moving) else 0.0

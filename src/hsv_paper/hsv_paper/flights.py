"""Flights for the figures and studies: single flights, and flights of many vehicles with their measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import Corner
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightData
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import TubeLevels, fly_perturbed
from hsv.model.plant import FlightStatus
from hsv_paper.designs import tube_of

Table = dict[str, np.ndarray]
"""One column (flights) per measure, the nominal vehicle first; NaN if a flight does not define the measure."""

AFTER = 20.0
"""Seconds after the fault over which errors are averaged."""

RINGING = (10.0, 20.0)
"""Seconds after the fault: an interval in which only vibration remains."""

SETTLED = 0.05
"""An angle or the pitch rate has settled within this share of its largest distance from its final value."""

LAST = 1.0
"""Seconds before the end, several periods of both modes. Vibration that lasts into them has not decayed."""


@dataclass(frozen=True)
class Point:
    """The flat parameters of a flight, and its vehicles as relative parameter changes; the nominal one first."""

    values: Mapping[str, Any]
    over: Sequence[Corner]


@cache
def flight_of(scenario: str) -> FlightData:
    """Return the flight of a shipped scenario by its name."""
    return fly(assemble(flight_parameters(load_scenario(scenario))))


def fly_over(point: Point, progress: Callable[[int], None] = lambda done: None) -> Table:
    """Return the measures of the flights of all vehicles of a point; one thread per processor flies them."""
    parts = assemble(dict(point.values))
    levels = TubeLevels(parts)

    def measures(corner: Corner, flight: Flight) -> dict[str, float]:
        level = levels.worst(flight)
        return {
            "diverged": float(flight.status is FlightStatus.DIVERGED),
            "end_time": float(flight.time[-1]),
            **({} if level is None else {"tube_level": level}),
            **flight_measures(flight),
        }

    rows = fly_perturbed(parts, point.over, measures, progress)
    names = list(dict.fromkeys(name for row in rows for name in row))
    return {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}


def flight_measures(flight: FlightData) -> dict[str, float]:
    """Return the metrics of a flight and further measures (SI); undefined ones are omitted.

    All further ones but ``attitude_from_reference`` need 20 s of flight after the fault. ``rigid_error``: the rms tube
    error over these 20 s, each rigid-body state divided by the half-width of the baseline's invariant set.
    """
    values, state = dict(flight.metrics), flight.history.state
    deviation = np.abs(state - flight.reference)
    values["attitude_from_reference"] = float(deviation[:, 2:4].max())
    if flight.fault_start is None or flight.time[-1] < flight.fault_start + AFTER:
        return values
    since = flight.time - flight.fault_start
    after, window = since >= 0.0, (since >= 0.0) & (since <= AFTER)
    ringing = (since >= RINGING[0]) & (since <= RINGING[1])
    error = (state - flight.reference - flight.history.deviation)[window, :5]
    values["post_fault_altitude_error"] = float(deviation[after, 0].max())
    values["rigid_error"] = float(np.sqrt(np.mean((error / tube_of("baseline").half_width[:5]) ** 2)))
    values["pitch_rate_error"] = float(np.sqrt(np.mean(error[:, 4] ** 2)))
    values["pitch_rate_ringing"] = float(np.ptp(state[ringing, 4]))
    for mode, column in ((1, 5), (2, 7)):
        values[f"elastic_coordinate_{mode}_span"] = float(np.ptp(state[after, column]))
        values[f"elastic_rate_{mode}_span"] = float(np.ptp(state[after, column + 1]))
        values[f"elastic_rate_{mode}_ringing"] = float(np.ptp(state[ringing, column + 1]))
    values["attitude_settling_time"] = _settling_time(since[after], state[after, 2:4])
    values["pitch_rate_settling_time"] = _settling_time(since[after], state[after, 4:5])
    decay = values.get("elastic_decay_time", np.inf)
    values["elastic_settling_time"] = decay if decay < since[-1] - LAST else np.inf
    return values


def _settling_time(time: np.ndarray, states: np.ndarray) -> float:
    """Return the last ``time`` (s) at which any of ``states``, shape (n, m), is not :data:`SETTLED`; 0 if none."""
    distance = np.abs(states - states[-1])
    moving = np.flatnonzero(np.any(distance > SETTLED * distance.max(axis=0), axis=1))
    return float(time[moving[-1]]) if len(moving) else 0.0

"""A simulated flight: its history, status and metrics."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.flight.fingerprint import fingerprint
from hsv.flight.history import History
from hsv.flight.metrics import FlightData, flight_metrics
from hsv.model.dynamics import in_model_range
from hsv.model.plant import FlightStatus
from hsv.model.signals import NEVER

if TYPE_CHECKING:
    from hsv.flight.closed_loop import Components


@lru_cache(maxsize=8)
def times(rows: int, period: float) -> np.ndarray:
    """Return the simulated time (s) of ``rows`` steps; flights of the same length share the array."""
    found = np.arange(rows) * period
    found.setflags(write=False)
    return found


@dataclass(frozen=True, repr=False)
class Flight:
    """A flight: control period (s), history, reference, time of the first fault (s) and final status."""

    period: float
    history: History
    trajectory: ReferenceTrajectory
    fault_start: float | None
    status: FlightStatus

    @property
    def time(self) -> np.ndarray:
        """Simulated time (n + 1), s; flights of the same length share the array."""
        return times(len(self.history.state), self.period)

    @property
    def reference(self) -> np.ndarray:
        """x_r (n + 1, 9)."""
        return self.trajectory.along(len(self.history.flown)).state

    @property
    def reference_input(self) -> np.ndarray:
        """u_r (n + 1, 2)."""
        return self.trajectory.along(len(self.history.flown)).input

    @property
    def defect(self) -> np.ndarray:
        """d_r (n + 1, 9), see :mod:`hsv.control.reference_trajectory`."""
        return self.trajectory.along(len(self.history.flown)).defect

    @property
    def fingerprint(self) -> str:
        """The digest of all bits of the history, see :mod:`hsv.flight.fingerprint`."""
        return fingerprint(self.history.flown)

    @cached_property
    def metrics(self) -> dict[str, float]:
        """The metrics that the flight defines, SI, by the names in :data:`hsv.flight.metrics.METRICS`."""
        return flight_metrics(self.data())

    def __repr__(self) -> str:
        steps = len(self.history.flown) - 1
        return f"<Flight of {steps * self.period:g} s, {steps} steps, {self.status.name.lower()}, {self.fingerprint}>"

    def data(self) -> FlightData:
        """Return the data from which metrics are computed."""
        h = self.history
        return FlightData(
            time=self.time,
            state=h.state,
            reference=self.reference,
            deviation=h.deviation,
            command=h.command,
            unlimited=h.u_unsaturated,
            gain_index=h.gain_index,
            fault_start=self.fault_start,
        )


def flight_of(components: Components, history: History) -> Flight:
    """Return the flight of ``components`` with its ``history``."""
    plant = components.plant
    diverged = not in_model_range(history.state[-1], plant.vehicle.angle_limit)
    status = FlightStatus.DIVERGED if diverged else FlightStatus.FINISHED
    reference, start = components.nominal_trajectory.reference, fault_start(components, len(history.state))
    return Flight(plant.period, history, reference, start, status)


def fault_start(components: Components, rows: int) -> float | None:
    """Return the start (s) of the first fault within a flight of ``rows`` steps, None without one."""
    first = min((row.start for row in components.fault_injector.known), default=NEVER)
    return first * components.plant.period if first < rows else None

"""What was flown in one process, and what is said of it."""

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
    """Return the simulated time (s) of so many ``rows``, shared by all callers that ask for as many."""
    found = np.arange(rows) * period
    found.setflags(write=False)
    return found


@dataclass(frozen=True)
class Flight:
    """A flight: ``period`` (s), what happened at each step, along which reference, time of the first fault."""

    period: float
    history: History
    trajectory: ReferenceTrajectory
    fault_start: float | None
    status: FlightStatus

    @property
    def time(self) -> np.ndarray:
        """Simulated time (n + 1), s; all flights of so many steps share it."""
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
        """The digest of all its bits, see :mod:`hsv.flight.fingerprint`."""
        return fingerprint(self.history.flown)

    @cached_property
    def metrics(self) -> dict[str, float]:
        """The metrics that it defines, SI, by the names in :data:`hsv.flight.metrics.METRICS`."""
        return flight_metrics(self.data())

    def data(self) -> FlightData:
        """Return what the metrics are made of."""
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
    """Return what the ``components`` flew."""
    plant = components.plant
    diverged = not in_model_range(history.state[-1], plant.vehicle.angle_limit)
    status = FlightStatus.DIVERGED if diverged else FlightStatus.FINISHED
    reference, start = components.nominal_trajectory.reference, fault_start(components, len(history.state))
    return Flight(plant.period, history, reference, start, status)


def fault_start(components: Components, rows: int) -> float | None:
    """Return when the first fault of a flight of so many ``rows`` begins (s), ``None`` where none does."""
    first = min((row.start for row in components.fault_injector.known), default=NEVER)
    return first * components.plant.period if first < rows else None

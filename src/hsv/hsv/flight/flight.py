"""A simulated flight: its history, status and metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.flight.fingerprint import fingerprint
from hsv.flight.history import History
from hsv.flight.metrics import FlightData
from hsv.model.dynamics import in_model_range
from hsv.model.plant import FlightStatus
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_STATES, NEVER, STATE_NAMES, STATE_UNITS

if TYPE_CHECKING:
    from pandas import DataFrame

    from hsv.flight.closed_loop import Components


def _along(name: str, meaning: str) -> property:
    """Return a property of :class:`Flight`: the array ``name`` of its reference trajectory, with one row per step."""
    return property(lambda flight: getattr(flight.trajectory.along(len(flight.history.signals)), name), doc=meaning)


@dataclass(frozen=True, repr=False)
class Flight(FlightData):
    """A simulated flight, with its control period (s), its reference trajectory and its final status."""

    period: float
    trajectory: ReferenceTrajectory
    status: FlightStatus
    law_times: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Wall times (s) of every step of the nominal law and the controller, by block; only laws in Python are measured"""

    reference_input = _along("input", "Reference input u_r (n + 1, 2)")
    defect = _along("defect", "Defect d_r (n + 1, 9), see :mod:`hsv.control.reference_trajectory`")

    @property
    def plan(self) -> np.ndarray:
        """The input u_r + u_n of the nominal trajectory, shape (n + 1, 2)."""
        return np.asarray(self.history.nominal_input + self.reference_input)

    @property
    def fingerprint(self) -> str:
        """The digest of all bits of ``history.signals``, see :mod:`hsv.flight.fingerprint`."""
        return fingerprint(self.history.signals)

    def __repr__(self) -> str:
        steps = len(self.history.signals) - 1
        return f"<Flight of {steps * self.period:g} s, {steps} steps, {self.status.name.lower()}, {self.fingerprint}>"

    def to_frame(self) -> DataFrame:
        """Return the signals of history and reference as a table with one row per step; the index is time (s).

        A column has a name such as ``state.altitude``. The units (SI) of the columns are in ``attrs["units"]``.
        """
        from pandas import DataFrame, Index

        names = {
            N_STATES: dict(zip(STATE_NAMES, STATE_UNITS, strict=True)),
            N_INPUTS: dict(zip(INPUT_NAMES, INPUT_UNITS, strict=True)),
        }
        reference = {"reference": self.reference, "reference_input": self.reference_input}
        columns, units = {}, {}
        for signal, values in (self.history.columns() | reference).items():
            if values.ndim == 1:
                columns[signal], units[signal] = values, "rad/s" if signal == "filtered_pitch_rate" else "1"
                continue
            for column, (name, unit) in zip(values.T, names[values.shape[1]].items(), strict=True):
                columns[f"{signal}.{name}"], units[f"{signal}.{name}"] = column, unit
        frame = DataFrame(columns, index=Index(self.time, name="time"))
        frame.attrs["units"] = {"time": "s", **units}
        return frame


def step_statistics(seconds: Sequence[float]) -> dict[str, float]:
    """Return median, 99th percentile and maximum (ms) of the wall times ``seconds``; each is one of these times."""
    last = len(seconds) - 1
    places = {"median_ms": round(0.5 * last), "p99_ms": round(0.99 * last), "max_ms": last}
    placed = np.partition(seconds, [*places.values()])
    return {name: 1e3 * float(placed[place]) for name, place in places.items()}


def step_times_in_words(step_times: dict[str, Any]) -> str:
    """Return one line: the wall times of the control laws by node and, if known, of a whole step, and the period."""
    times = [
        f"{name} median {times['median_ms']:.3g}, p99 {times['p99_ms']:.3g}, max {times['max_ms']:.3g} ms"
        for name, times in step_times["nodes"].items()
    ]
    if loop := step_times.get("loop_mean_ms"):
        times.append(f"one step (law, vehicle, sensors) mean {loop:.3g} ms")
    return "; ".join([*times, f"period {step_times['period_ms']:g} ms"])


def flight_of(components: Components, history: History, memory: tuple[np.ndarray, np.ndarray] | None = None) -> Flight:
    """Return the flight that ``components`` have flown, with this ``history``; ``memory`` is that of its curves."""
    plant = components.plant
    diverged = not in_model_range(history.state[-1], plant.vehicle.angle_limit)
    status = FlightStatus.DIVERGED if diverged else FlightStatus.FINISHED
    rows, trajectory = len(history.signals), components.nominal_trajectory.reference
    time, reference, start = np.arange(rows) * plant.period, trajectory.along(rows).state, fault_start(components, rows)
    return Flight(time, history, reference, start, plant.period, trajectory, status, memory=memory)


def fault_start(components: Components, rows: int) -> float | None:
    """Return the time (s) at which the first fault starts, None if no fault starts within ``rows`` steps."""
    first = min((row.start for row in components.fault_injector.known), default=NEVER)
    return first * components.plant.period if first < rows else None

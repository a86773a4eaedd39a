"""The data of a simulated or recorded flight, and the metrics that are computed from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from hsv.base.units import significant
from hsv.core import doubles, ffi, lib, vector
from hsv.flight.history import History
from hsv.model.signals import N_INPUTS

SETTLING_BAND = 0.02
"""Largest error of a settled response, as a share of the step."""

DECAY_LEVEL = 0.05
"""Largest magnitude of a decayed elastic rate, as a share of its peak after the fault."""

PRE_FAULT_WINDOW = 5.0
"""Length of the window before the fault over which the mean attitude is taken, s."""

NOT_REACHED = "not within"
"""Beginning of the reason why a metric is missing that applies to a flight: a time that the flight did not reach."""

NO_FAULT = "no fault"
"""Reason why the metrics of the time after a fault do not apply to a flight."""


class Group(StrEnum):
    """Groups of metrics in the order of display."""

    tracking = "tracking"
    after_the_fault = "after the fault"
    modes = "modes"
    inputs = "inputs"
    requirements = "requirements"


@dataclass(frozen=True)
class Metric:
    """Definition of a metric: unit (SI), meaning and group."""

    unit: str
    meaning: str
    group: Group
    formula: str = ""
    """The definition in the symbols of docs/metrics.md, where the table is printed"""
    needs: str = ""
    """What a flight must have for the metric to apply; empty: it applies to every flight"""
    share: bool = False
    """Whether the metric is a share, displayed in percent"""
    counted: bool = False
    """Whether the metric is a number of steps"""
    signed: bool = False
    """Whether the metric is an error with a sign, which is judged and ranked by its magnitude"""


def _tracking(axis: str, symbol: str, unit: str, integral: str) -> dict[str, Metric]:
    """Return the definitions of the tracking metrics of one axis, altitude or velocity, by name.

    ``symbol`` and ``unit`` (SI) are those of the axis; ``integral`` is the unit of its error integrated over time.
    """
    error = f"{symbol} - {symbol}_r"
    settled = f"last time before the fault that {axis} is more than 2 % of the step off"
    over = f"largest excess over the {axis} step before the fault, share of the step"
    step = f"step of {axis}"
    return {
        f"{axis}_rise_time": Metric(
            "s", f"10 % to 90 % of the {axis} step", Group.tracking, "t(0.9) - t(0.1), t(s): first t with r >= s", step
        ),
        f"{axis}_settling_time": Metric("s", settled, Group.tracking, "first t from which |r - 1| <= 0.02", step),
        f"{axis}_overshoot": Metric("1", over, Group.tracking, "max(0, max r - 1)", step, share=True),
        f"{axis}_integral_absolute_error": Metric(
            integral, f"integral of |{error}|", Group.tracking, "integral of |e| dt, trapezoidal"
        ),
        f"{axis}_error_maximum": Metric(unit, f"largest |{error}|", Group.tracking, "max |e|"),
        f"{axis}_end_error": Metric(unit, f"{error} at the end", Group.tracking, "e at the last step", signed=True),
    }


_DECAY, _ELASTIC = "first s with |rate {}| <= 0.05 of its maximum for t > t_f + s", "fault, and an elastic vehicle"

METRICS = {
    **_tracking("altitude", "h", "m", "m s"),
    **_tracking("velocity", "V", "m/s", "m"),
    "post_fault_attitude_deviation": Metric(
        "rad",
        "largest change of angle of attack or pitch angle after the fault from its mean over the 5 s before",
        Group.after_the_fault,
        "max |a - mean of a over [t_f - 5 s, t_f)|, t >= t_f, a: alpha, theta",
        needs="fault, and a step before it",
    ),
    "post_fault_attitude_from_nominal": Metric(
        "rad",
        "largest difference of angle of attack or pitch angle after the fault from reference + nominal",
        Group.after_the_fault,
        "max |a - a_r - a_n|, t >= t_f, a: alpha, theta",
        needs="fault",
    ),
    "attitude_from_nominal": Metric(
        "rad",
        "largest difference of angle of attack or pitch angle from reference + nominal, over the whole flight",
        Group.tracking,
        "max |a - a_r - a_n|, a: alpha, theta",
    ),
    "elastic_rate_1_decay_time": Metric(
        "s",
        "time after the fault from which |rate| stays within 5 % of its peak",
        Group.modes,
        "first s with |rate 1| <= 0.05 of its maximum for all t > t_f + s",
        needs="fault, and an elastic vehicle",
    ),
    "elastic_rate_2_decay_time": Metric(
        "s",
        "the same for the second mode",
        Group.modes,
        "first s with |rate 2| <= 0.05 of its maximum for all t > t_f + s",
        needs="fault, and an elastic vehicle",
    ),
    "elastic_decay_time": Metric("s", "the slower of the two", Group.modes, "max of both", _ELASTIC),
    "fuel_equivalence_ratio_minimum": Metric("1", "smallest command", Group.inputs, "min Phi"),
    "fuel_equivalence_ratio_maximum": Metric("1", "largest command", Group.inputs, "max Phi"),
    "elevator_deflection_minimum": Metric("rad", "smallest command", Group.inputs, "min delta_e"),
    "elevator_deflection_maximum": Metric("rad", "largest command", Group.inputs, "max delta_e"),
    "saturated_steps": Metric(
        "1", "steps in which a command was limited", Group.inputs, "number of k with u(k) clipped", counted=True
    ),
}
"""The definitions of all metrics by name, in the order in which files contain them."""

MARGIN = "margin_"
"""Beginning of the names of the margins of requirements (:mod:`hsv.flight.requirement`), which are metrics, too."""

_MARGIN = Metric("1", "margin of the requirement as a share of its bound", Group.requirements)

CRITERIA = (
    "altitude_end_error",
    "velocity_end_error",
    "post_fault_attitude_deviation",
    "post_fault_attitude_from_nominal",
    "elastic_decay_time",
    "saturated_steps",
)
"""The metrics by which the paper judges a flight. A report names those for which the scenario has no limit."""


def spaced(name: str) -> str:
    """Return the ``name`` of a metric, or another identifier, as words separated by spaces."""
    return _TITLES.get(name) or name.replace("_", " ")


_TITLES = {
    "post_fault_attitude_deviation": "attitude change after fault",
    "post_fault_attitude_from_nominal": "attitude off nominal after fault",
    "attitude_from_nominal": "attitude off nominal",
}
"""Metrics with a plainer name on pages and terminal than in files."""


def is_share(name: str) -> bool:
    """Return whether ``name`` is a metric that is a share, displayed in percent."""
    return name in METRICS and METRICS[name].share


def metric_of(name: str) -> Metric:
    """Return the definition of the metric ``name``, which may be the margin of a requirement."""
    return _MARGIN if name.startswith(MARGIN) else METRICS[name]


def grouped(names: Iterable[str]) -> dict[Group, dict[str, Metric]]:
    """Return the definitions of the metrics with these ``names``, by group and name, in the order of display."""
    known = dict.fromkeys(names)
    ordered = [*(name for name in METRICS if name in known), *(name for name in known if name.startswith(MARGIN))]
    groups = {group: {n: m for n in ordered if (m := metric_of(n)).group is group} for group in Group}
    return {group: metrics for group, metrics in groups.items() if metrics}


CURVES = 10
"""Number of rows of :attr:`FlightData.curves`."""


def curve_memory(rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Return uninitialised memory for the curves and the saturation of a flight of at most ``rows`` steps."""
    return np.empty((CURVES, rows)), np.empty((rows, N_INPUTS), np.uint8)


@dataclass(frozen=True)
class FlightData:
    """The signals of a simulated or recorded flight in the steps k = 0 ... n, from which metrics are computed; SI."""

    time: np.ndarray
    """Simulated time (n + 1), s"""
    history: History
    reference: np.ndarray
    """Reference state x_r (n + 1, 9)"""
    fault_start: float | None
    """Time of the first fault (s), None without a fault"""
    memory: tuple[np.ndarray, np.ndarray] | None = field(default=None, repr=False, kw_only=True)
    """Memory from :func:`curve_memory` for :attr:`curves` and :attr:`saturated`; None: allocate it when needed"""

    @cached_property
    def _evaluated(self) -> tuple[np.ndarray, np.ndarray]:
        """The :attr:`curves`, shape (10, n + 1), and :attr:`saturated`, shape (n + 1, 2)."""
        rows = len(self.time)
        curves, saturated = self.memory or curve_memory(rows)
        inputs = map(doubles, map(vector, (self.history.signals, self.history.auxiliary, self.reference)))
        lib.hsv_curves(rows, curves.shape[1], *inputs, doubles(curves), ffi.from_buffer("uint8_t *", saturated))
        return curves[:, :rows], saturated[:rows].view(bool)

    @property
    def curves(self) -> np.ndarray:
        """The ten signals from which metrics are computed, shape (10, n + 1), SI.

        Rows: altitude error; velocity error; angle of attack; pitch angle; rates of the two elastic modes; the two
        commands u; absolute differences of angle of attack and of pitch angle from x_r + x_n.
        """
        return self._evaluated[0]

    @property
    def saturated(self) -> np.ndarray:
        """Whether the command of each input was saturated, by step, shape (n + 1, 2)."""
        return self._evaluated[1]

    @cached_property
    def _measured(self) -> dict[str, float | str]:
        return _metrics(self)

    @cached_property
    def metrics(self) -> dict[str, float]:
        """The metrics that the flight defines, SI, by their names in :data:`METRICS`."""
        return {name: value for name, value in self._measured.items() if not isinstance(value, str)}

    @cached_property
    def missing(self) -> dict[str, str]:
        """The reason for each metric that the flight does not define: it does not apply, or :data:`NOT_REACHED`."""
        return {name: value for name, value in self._measured.items() if isinstance(value, str)}


def _metrics(flight: FlightData) -> dict[str, float | str]:
    """Return all metrics of a flight, SI, by name, in the order of :data:`METRICS`: a value, or why there is none.

    The metrics of a fault apply if one starts after step 0.
    """
    values: dict[str, float | str] = dict.fromkeys(METRICS, NO_FAULT)
    time, curves = flight.time, flight.curves
    faultless = len(time) if flight.fault_start is None else int(np.searchsorted(time, flight.fault_start - 1e-9))
    before, after = slice(faultless), slice(faultless, None)
    steps = np.diff(time)
    for axis, error in zip(("altitude", "velocity"), curves[:2], strict=True):
        for name, value in _step_metrics(time[before], error[before]).items():
            values[f"{axis}_{name}"] = f"no {axis} step" if value == "" else value
        magnitude = np.abs(error)
        integrals = 0.5 * (magnitude[1:] + magnitude[:-1]) * steps
        values[f"{axis}_integral_absolute_error"] = float(np.sum(integrals))
        values[f"{axis}_error_maximum"] = float(np.max(magnitude))
        values[f"{axis}_end_error"] = float(error[-1])
    tube_error = curves[8:10]
    values["attitude_from_nominal"] = float(np.max(tube_error))
    if 0 < faultless < len(time):
        start = time[faultless]
        window = slice(int(np.searchsorted(time, start - PRE_FAULT_WINDOW - 1e-9)), faultless)
        if window.start < faultless:  # a recording with a gap before the fault has no mean
            mean = np.ascontiguousarray(curves[2:4, window].T).mean(axis=0)  # summed row by row, in a fixed order
            values["post_fault_attitude_deviation"] = float(np.max(np.abs(curves[2:4, after] - mean[:, None])))
        else:
            values["post_fault_attitude_deviation"] = "no step before the fault"
        values["post_fault_attitude_from_nominal"] = float(np.max(tube_error[:, after]))
        decays: list[float | str] = ["rigid vehicle"] * 2
        if curves[4:6].any():
            decays = [_decay_time(time[after], np.abs(rate[after])) for rate in curves[4:6]]
        values["elastic_rate_1_decay_time"], values["elastic_rate_2_decay_time"] = decays
        late = [each for each in decays if isinstance(each, str)]
        values["elastic_decay_time"] = late[0] if late else max(map(float, decays))
    for name, command in zip(("fuel_equivalence_ratio", "elevator_deflection"), curves[6:8], strict=True):
        values[f"{name}_minimum"] = float(np.min(command))
        values[f"{name}_maximum"] = float(np.max(command))
    values["saturated_steps"] = float(np.count_nonzero(flight.saturated[:, 0] | flight.saturated[:, 1]))
    return values


def _step_metrics(time: np.ndarray, error: np.ndarray) -> dict[str, float | str]:
    """Return rise time (s), settling time (s) and overshoot (share of the step) of a step response, by name.

    ``time`` (s) and ``error``, the tracking error, have shape (n,); the first error is the size of the step. If the
    response does not rise or settle, the reason is in place of the time. Without a step, or if n < 2, all are "".
    """
    if len(time) < 2 or abs(error[0]) < 1e-6:
        return dict.fromkeys(("overshoot", "rise_time", "settling_time"), "")
    done, late = 1.0 - error / error[0], _not_within(time)
    values: dict[str, float | str] = {"overshoot": max(0.0, float(np.max(done)) - 1.0)}
    values |= {"rise_time": late, "settling_time": late}
    if (risen := done >= 0.9).any():
        values["rise_time"] = float(time[np.argmax(risen)] - time[np.argmax(done >= 0.1)])
    settled = np.flatnonzero(np.abs(done - 1.0) > SETTLING_BAND)[-1] + 1  # the first sample is outside the band
    if settled < len(time):
        values["settling_time"] = float(time[settled])
    return values


def _decay_time(time: np.ndarray, magnitude: np.ndarray) -> float | str:
    """Return the time (s) after ``time[0]`` at which ``magnitude`` last exceeds :data:`DECAY_LEVEL` times its peak.

    A magnitude that is NaN counts as above the level. If the last magnitude is above it, return that as the reason.
    """
    above = np.nonzero(~(magnitude <= DECAY_LEVEL * np.max(magnitude)))[0]
    if not len(above):
        return 0.0
    return _not_within(time) if above[-1] == len(time) - 1 else float(time[above[-1]] - time[0])


def _not_within(time: np.ndarray) -> str:
    return f"{NOT_REACHED} {significant(time[-1] - time[0])} s"

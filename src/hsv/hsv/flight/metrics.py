"""The metrics of a flight: one implementation, for recorded flights and for those flown in process."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hsv.core import doubles, ffi, lib
from hsv.flight.history import ACTUATOR, BESIDE, FLOWN, Q_F, U_N, U_UNSATURATED, X_N, U, X

SETTLING_BAND = 0.02
"""Share of the step within which a response counts as settled."""

DECAY_LEVEL = 0.05
"""Share of its own post-fault peak below which an elastic rate counts as decayed."""

PRE_FAULT_WINDOW = 5.0
"""Seconds before the fault over which the pre-fault mean is taken."""


class Group(StrEnum):
    """Group of metrics, in the order in which they are displayed."""

    tracking = "tracking"
    after_the_fault = "after the fault"
    modes = "modes"
    inputs = "inputs"


@dataclass(frozen=True)
class Metric:
    """Definition of a metric: its name in words, its unit (SI), its meaning, and its group."""

    words: str
    unit: str
    meaning: str
    group: Group
    share: bool = False
    """Whether it is a share of something, which people read in percent"""


METRICS = {
    "altitude_rise_time": Metric("altitude rise time", "s", "10 % to 90 % of the altitude step", Group.tracking),
    "altitude_settling_time": Metric(
        "altitude settling time",
        "s",
        "last time before the fault that altitude is more than 2 % of the step off",
        Group.tracking,
    ),
    "altitude_overshoot": Metric(
        "altitude overshoot",
        "1",
        "largest excess over the altitude step before the fault, share of the step",
        Group.tracking,
        share=True,
    ),
    "altitude_integral_absolute_error": Metric(
        "altitude error, integral", "m s", "integral of |h - h_r|", Group.tracking
    ),
    "altitude_error_maximum": Metric("altitude error, largest", "m", "largest |h - h_r|", Group.tracking),
    "altitude_end_error": Metric("altitude error at the end", "m", "h - h_r at the end", Group.tracking),
    "velocity_rise_time": Metric("velocity rise time", "s", "10 % to 90 % of the velocity step", Group.tracking),
    "velocity_settling_time": Metric(
        "velocity settling time",
        "s",
        "last time before the fault that velocity is more than 2 % of the step off",
        Group.tracking,
    ),
    "velocity_overshoot": Metric(
        "velocity overshoot",
        "1",
        "largest excess over the velocity step before the fault, share of the step",
        Group.tracking,
        share=True,
    ),
    "velocity_integral_absolute_error": Metric(
        "velocity error, integral", "m", "integral of |V - V_r|", Group.tracking
    ),
    "velocity_error_maximum": Metric("velocity error, largest", "m/s", "largest |V - V_r|", Group.tracking),
    "velocity_end_error": Metric("velocity error at the end", "m/s", "V - V_r at the end", Group.tracking),
    "post_fault_attitude_deviation": Metric(
        "attitude change after the fault",
        "rad",
        "largest change of angle of attack or pitch angle after the fault from its mean over the 5 s before",
        Group.after_the_fault,
    ),
    "post_fault_attitude_from_nominal": Metric(
        "attitude from nominal after the fault",
        "rad",
        "largest difference of angle of attack or pitch angle after the fault from reference + nominal",
        Group.after_the_fault,
    ),
    "attitude_from_nominal": Metric(
        "attitude from nominal",
        "rad",
        "largest difference of angle of attack or pitch angle from reference + nominal, over the whole flight",
        Group.tracking,
    ),
    "elastic_rate_1_decay_time": Metric(
        "first mode's decay time",
        "s",
        "time after the fault from which |rate| stays within 5 % of its peak",
        Group.modes,
    ),
    "elastic_rate_2_decay_time": Metric("second mode's decay time", "s", "the same for the second mode", Group.modes),
    "elastic_decay_time": Metric("elastic decay time", "s", "the slower of the two", Group.modes),
    "fuel_equivalence_ratio_minimum": Metric("fuel equivalence ratio, least", "1", "least command", Group.inputs),
    "fuel_equivalence_ratio_maximum": Metric("fuel equivalence ratio, largest", "1", "largest command", Group.inputs),
    "elevator_deflection_minimum": Metric("elevator deflection, least", "rad", "least command", Group.inputs),
    "elevator_deflection_maximum": Metric("elevator deflection, largest", "rad", "largest command", Group.inputs),
    "saturated_steps": Metric("saturated steps", "1", "steps in which a command was limited", Group.inputs),
}
"""Every metric, in the order in which files have them."""

CRITERIA = (
    "altitude_end_error",
    "velocity_end_error",
    "post_fault_attitude_deviation",
    "post_fault_attitude_from_nominal",
    "elastic_decay_time",
    "saturated_steps",
)
"""The metrics that the paper judges a flight by: where a scenario has no limit for one of them, it is named."""


def in_words(name: str) -> str:
    """Return what people call a metric, or whatever else the program has a name for."""
    return METRICS[name].words if name in METRICS else name.replace("_", " ")


def is_share(name: str) -> bool:
    """Return whether what is kept of a flight under a name is a share of something, which people read in percent."""
    return name in METRICS and METRICS[name].share


CURVES = 10
"""Number of the curves of a :class:`FlightCurves`."""


class FlightCurves(NamedTuple):
    """What metrics are made of, rows k = 0 ... n.

    ``curves``, each on its own as it is read many times (10, n + 1): altitude and velocity less their references; angle
    of attack and pitch angle; the two elastic rates; the commands; the magnitudes of what angle of attack and pitch
    angle differ by from reference + nominal. Beside them time (s), whether each command was limited (n + 1, 2), and the
    time of the first fault.
    """

    time: np.ndarray
    curves: np.ndarray
    saturated: np.ndarray
    fault_start: float | None


@dataclass(frozen=True)
class FlightData:
    """Data for metrics, rows k = 0 ... n: time (s); x, x_r, x_n (9); commands, limited and unlimited (2 each).

    ``unlimited`` is not a number where no more is known than that the command was limited. ``gain_index`` is the
    nominal gain in use, counted from the outermost of the family.
    """

    time: np.ndarray
    state: np.ndarray
    reference: np.ndarray
    deviation: np.ndarray
    command: np.ndarray
    unlimited: np.ndarray
    gain_index: np.ndarray
    fault_start: float | None
    """Time of the first fault (s), ``None`` without one."""

    @property
    def curves(self) -> np.ndarray:
        """Curves of :class:`FlightCurves`."""
        return self.flight_curves.curves

    @property
    def saturated(self) -> np.ndarray:
        """Whether each command was limited (n + 1, 2)."""
        return self.flight_curves.saturated

    @cached_property
    def flight_curves(self) -> FlightCurves:
        """What metrics are made of."""
        rows = len(self.state)
        flown, beside = np.zeros((rows, FLOWN)), np.zeros((rows, BESIDE))
        flown[:, X:Q_F], flown[:, X_N:U_N], flown[:, U:ACTUATOR] = self.state, self.deviation, self.command
        beside[:, U_UNSATURATED:] = self.unlimited
        curves, saturated = np.empty((CURVES, rows)), np.empty(self.command.shape, bool)
        read_curves(flown, beside, np.ascontiguousarray(self.reference, float), curves, saturated)
        return FlightCurves(self.time, curves, saturated, self.fault_start)


def read_curves(
    flown: np.ndarray, beside: np.ndarray, reference: np.ndarray, curves: np.ndarray, saturated: np.ndarray
) -> None:
    """Write the ``curves`` (10, n) and the saturation (n, 2) of the rows of a history, see ``core/metrics.h``.

    ``curves`` may be columns of a longer array.
    """
    stride = curves.strides[0] // curves.itemsize
    given = map(doubles, (flown, beside, reference))
    lib.hsv_curves(len(flown), stride, *given, _start(curves, "double *"), _start(saturated, "uint8_t *"))


def _start(array: np.ndarray, kind: str) -> Any:
    return ffi.cast(kind, array.__array_interface__["data"][0])


def flight_metrics(flight: FlightData | FlightCurves) -> dict[str, float]:
    """Return the metrics of ``flight``, SI; those that it does not define (no step, no fault) are left out."""
    values: dict[str, float] = {}
    time, curves = flight.time, flight.curves
    faultless = len(time) if flight.fault_start is None else int(np.searchsorted(time, flight.fault_start - 1e-9))
    before, after = slice(faultless), slice(faultless, None)
    steps = np.diff(time)
    for axis, error in zip(("altitude", "velocity"), curves[:2], strict=True):
        values |= {f"{axis}_{name}": value for name, value in _step_metrics(time[before], error[before]).items()}
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
        if window.start < faultless:  # of a recording with a gap before the fault there is no mean
            mean = np.ascontiguousarray(curves[2:4, window].T).mean(axis=0)  # added row by row
            values["post_fault_attitude_deviation"] = float(np.max(np.abs(curves[2:4, after] - mean[:, None])))
        values["post_fault_attitude_from_nominal"] = float(np.max(tube_error[:, after]))
        for mode, rate in enumerate(curves[4:6], 1):
            values[f"elastic_rate_{mode}_decay_time"] = _decay_time(time[after], np.abs(rate[after]))
        values["elastic_decay_time"] = max(values["elastic_rate_1_decay_time"], values["elastic_rate_2_decay_time"])
    for name, command in zip(("fuel_equivalence_ratio", "elevator_deflection"), curves[6:8], strict=True):
        values[f"{name}_minimum"] = float(np.min(command))
        values[f"{name}_maximum"] = float(np.max(command))
    values["saturated_steps"] = float(np.count_nonzero(flight.saturated[:, 0] | flight.saturated[:, 1]))
    return {name: values[name] for name in METRICS if name in values}


def _step_metrics(time: np.ndarray, error: np.ndarray) -> dict[str, float]:
    """Return rise time, settling time and overshoot of a step whose size is the first error."""
    if len(time) < 2 or abs(error[0]) < 1e-6:
        return {}
    done = 1.0 - error / error[0]
    values = {"overshoot": max(0.0, float(np.max(done)) - 1.0)}
    if (risen := done >= 0.9).any():
        values["rise_time"] = float(time[np.argmax(risen)] - time[np.argmax(done >= 0.1)])
    off = np.flatnonzero(np.abs(done - 1.0) > SETTLING_BAND)[-1:]
    if not len(off) or off[0] + 1 < len(time):
        values["settling_time"] = float(time[off[0] + 1 if len(off) else 0])
    return values


def _decay_time(time: np.ndarray, magnitude: np.ndarray) -> float:
    """Return after what time ``magnitude`` last exceeds the decay level of its own peak; what is no number, too."""
    above = np.nonzero(~(magnitude <= DECAY_LEVEL * np.max(magnitude)))[0]
    return float(time[above[-1]] - time[0]) if len(above) else 0.0

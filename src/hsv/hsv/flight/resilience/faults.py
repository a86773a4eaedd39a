"""The faults of resilience campaigns: what fails, how severely, and which parameter measures the severity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from hsv.base.units import rounded, written
from hsv.model.faults.table import FAULT_KINDS

RESOLUTION = 0.02
"""Accuracy, as a share of the range of severities, with which the largest survived severity is found."""

SEVERITIES = ("mild", "medium", "severe")


class Moment(StrEnum):
    """Time of occurrence of a fault."""

    during = "during the manoeuvre"
    after = "after the manoeuvre"

    @property
    def share(self) -> float:
        """Start of the fault as a share of the scenario's duration; in Case 1, the two moments are 30 s and 100 s."""
        return 0.15 if self is Moment.during else 0.5


OBSERVED = 0.5
"""Duration of a flight after the start of the fault, as a share of the scenario's duration."""


DURATION = "duration"
"""Value of :attr:`TriedFault.parameter` for a temporary fault whose severity is its duration."""


@dataclass(frozen=True)
class TriedFault:
    """A fault, one parameter of which is its severity; the other parameters are fixed."""

    channel: str
    kind: str
    parameter: str
    """The parameter that is the severity: one of the fault's kind or of its occurrence, or :data:`DURATION`"""
    unit: str
    """Unit in which the parameter is written."""
    harmless: float
    """Value of the parameter at severity 0"""
    worst: float
    """Value of the parameter at severity 1"""
    values: tuple[float, float, float]
    """Values of the parameter for a mild, a medium and a severe fault"""
    fixed: Mapping[str, Any] = field(default_factory=dict)
    """The other parameters by name, as written in a scenario file"""
    geometric: bool = False
    """Whether equal steps of severity are equal ratios of values; used for ranges over decades."""

    @property
    def whole(self) -> bool:
        """Whether the parameter is an integer."""
        return any(p.name == self.parameter and p.whole for p in FAULT_KINDS[self.kind].parameters)

    @property
    def resolution(self) -> float:
        """Gap in severity at which the bisection ends: :data:`RESOLUTION`, or that of adjacent integers if larger."""
        return max(RESOLUTION, 1.0 / abs(self.worst - self.harmless) if self.whole else 0.0)

    def value(self, severity: float) -> float:
        """Return the parameter's value, rounded if it is an integer, at a ``severity`` from 0 to 1."""
        # Both formulas are exact at severities 0 and 1.
        if self.geometric:
            value = self.harmless ** (1.0 - severity) * self.worst**severity
        else:
            value = (1.0 - severity) * self.harmless + severity * self.worst
        return float(round(value)) if self.whole else rounded(value)

    def severity(self, value: float) -> float:
        """Return the severity, from 0 to 1, of a ``value`` of the parameter."""
        if self.geometric:
            return math.log(value / self.harmless) / math.log(self.worst / self.harmless)
        return (value - self.harmless) / (self.worst - self.harmless)

    def row(self, value: float, start: float) -> dict[str, Any]:
        """Return the fault as a table of a scenario file, with the ``value`` of the parameter and the ``start`` (s)."""
        own = {"channel": self.channel, "type": self.kind, **self.fixed, "start": written(start, "s")}
        if self.parameter == DURATION:
            return {**own, "stop": written(rounded(start + value), self.unit)}
        return {**own, self.parameter: written(value, self.unit)}

    def values_text(self, *values: float) -> str:
        """Return ``values`` of the parameter as a text with their unit."""
        return f"{', '.join(f'{value:.3g}' for value in values)}{'' if self.unit == '1' else ' ' + self.unit}"

    @property
    def words(self) -> str:
        """The parameter with its three values and its range, and the fixed parameters, as a text."""
        tried = f"{self.values_text(*self.values)} ({self.harmless:g} to {self.values_text(self.worst)})"
        fixed = (f"{key.replace('_', ' ')} {value}" for key, value in self.fixed.items())
        return ", ".join([f"{self.parameter.replace('_', ' ')} {tried}", *fixed])


_ELEVATOR, _FUEL, _ENGINE = "elevator_deflection", "fuel_equivalence_ratio", "engine"
_ATTITUDE, _ANGLE, _RATE = "pitch_angle", "angle_of_attack", "pitch_rate"

TRIED = {
    "elevator_loss": TriedFault(_ELEVATOR, "loss_of_effectiveness", "effectiveness", "1", 1.0, 0.0, (0.9, 0.7, 0.5)),
    "elevator_delay": TriedFault(_ELEVATOR, "delay", "steps", "1", 1.0, 50.0, (1.0, 2.0, 5.0)),
    "elevator_dead_zone": TriedFault(_ELEVATOR, "dead_zone", "width", "deg", 0.0, 30.0, (0.5, 2.0, 10.0)),
    "elevator_backlash": TriedFault(_ELEVATOR, "backlash", "width", "deg", 0.0, 30.0, (0.5, 2.0, 10.0)),
    "elevator_bandwidth": TriedFault(
        _ELEVATOR, "bandwidth", "natural_frequency", "rad/s", 100.0, 0.5, (50.0, 20.0, 5.0), geometric=True
    ),
    "elevator_rate_limit": TriedFault(
        _ELEVATOR, "rate_limit", "rate", "deg/s", 100.0, 0.01, (20.0, 5.0, 1.0), geometric=True
    ),
    "elevator_stop": TriedFault(
        _ELEVATOR, "stop_limit", "upper", "deg", 25.0, 5.0, (20.0, 15.0, 13.0), {"lower": "-20 deg"}
    ),
    "elevator_bias": TriedFault(_ELEVATOR, "bias", "offset", "deg", 0.0, -25.0, (-2.0, -5.0, -10.0)),
    "elevator_drift": TriedFault(_ELEVATOR, "drift", "limit", "deg", 0.0, 25.0, (2.0, 5.0, 10.0), {"rate": "-1 deg/s"}),
    "elevator_oscillation": TriedFault(
        _ELEVATOR, "oscillation", "amplitude", "deg", 0.0, 30.0, (1.0, 5.0, 20.0), {"frequency": "1.2 Hz"}
    ),
    "elevator_lock": TriedFault(
        _ELEVATOR, "lock_in_place", "intermittent_duty", "1", 0.0, 1.0, (0.1, 0.3, 0.6), {"intermittent_period": "1 s"}
    ),
    "elevator_float": TriedFault(
        _ELEVATOR, "float", "intermittent_duty", "1", 0.0, 1.0, (0.05, 0.2, 0.4), {"intermittent_period": "0.5 s"}
    ),
    "elevator_hard_over": TriedFault(
        _ELEVATOR, "hard_over", DURATION, "s", 0.02, 1.0, (0.1, 0.2, 0.3), {"rate": "-100 deg/s"}
    ),
    "fuel_loss": TriedFault(_FUEL, "loss_of_effectiveness", "effectiveness", "1", 1.0, 0.0, (0.9, 0.5, 0.0)),
    "fuel_bandwidth": TriedFault(
        _FUEL, "bandwidth", "natural_frequency", "rad/s", 10.0, 0.1, (5.0, 2.0, 0.5), geometric=True
    ),
    "thrust_loss": TriedFault(_ENGINE, "thrust_loss", "share", "1", 1.0, 0.0, (0.9, 0.5, 0.0)),
    "inlet_unstart": TriedFault(_ENGINE, "inlet_unstart", "moment_zero", "1", 0.0, 0.5, (0.0225, 0.0675, 0.225)),
    "angle_of_attack_bias": TriedFault(_ANGLE, "sensor_bias", "offset", "deg", 0.0, 5.0, (0.1, 0.5, 2.0)),
    "angle_of_attack_noise": TriedFault(
        _ANGLE, "sensor_noise", "standard_deviation", "deg", 0.0, 2.0, (0.01, 0.057, 0.5)
    ),
    "pitch_angle_runaway": TriedFault(
        _ATTITUDE, "sensor_runaway", "rate", "deg/s", 0.0, 2.0, (0.01, 0.1, 0.5), {"limit": "20 deg"}
    ),
    "pitch_rate_scale": TriedFault(_RATE, "sensor_scale", "factor", "1", 1.0, 0.0, (0.9, 0.7, 0.5)),
    "pitch_rate_drop_out": TriedFault(_RATE, "sensor_drop_out", "probability", "1", 0.0, 1.0, (0.1, 0.5, 0.8)),
}
"""Faults by name; docs/resilience.md explains values and ranges.

A bias, a drift or a moment has the direction that a larger positive elevator deflection counters, the worse one: the
elevator is trimmed at 12 deg and limited to 30 deg. The moment of the mild unstart is that of one degree of elevator.
"""

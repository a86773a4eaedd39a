"""The signals of the loop with their names, units and sizes, and the conversion of times to steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

STATE_NAMES = (
    "altitude",
    "velocity",
    "angle_of_attack",
    "pitch_angle",
    "pitch_rate",
    "elastic_coordinate_1",
    "elastic_rate_1",
    "elastic_coordinate_2",
    "elastic_rate_2",
)
STATE_UNITS = ("m", "m/s", "rad", "rad", "rad/s", "kg^0.5 m", "kg^0.5 m/s", "kg^0.5 m", "kg^0.5 m/s")
INPUT_NAMES = ("fuel_equivalence_ratio", "elevator_deflection")
INPUT_UNITS = ("1", "rad")

N_STATES = len(STATE_NAMES)
N_INPUTS = len(INPUT_NAMES)
N_RIGID = 5
"""The first five states are those of the rigid body."""
PITCH_RATE = STATE_NAMES.index("pitch_rate")

PUBLISHED_ALTITUDE, PUBLISHED_VELOCITY = "85000 ft", "7702.0808 ft/s"
"""Flight condition of the trim published in the literature, the default of ``hsv trim`` and ``hsv linearise``."""

NEVER = 2**62
"""The number of a step that no flight reaches."""

VARYING = -1
"""Marks a signal whose size depends on the flight."""


@dataclass(frozen=True)
class SignalType:
    """Type of a signal between blocks; two are equal if name, unit and size are."""

    name: str
    unit: str
    """SI unit, or ``"1"``; several, separated by commas, apply to the numbers in turn; empty for mixed contents"""
    size: int
    meaning: str = field(default="", compare=False)
    fields: tuple[str, ...] = field(default=(), compare=False)
    """Places in messages: topic below ``hsv``, and the field at which the signal begins, which is a nested message, a
    sequence, or the first of several consecutive numbers"""
    components: tuple[str, ...] = field(default=(), compare=False)
    """Names of its numbers"""
    sequence: str = field(default="", compare=False)
    """Lengths that are admitted, in words, if it is sent as a sequence; else empty"""

    def admits(self, length: int) -> bool:
        """Return whether a sequence of this length may be the signal, which is left out if it has a fixed size."""
        return length % len(self.unit.split(", ")) == 0 if self.size == VARYING else length in (0, self.size)


SIGNALS: dict[str, SignalType] = {}
"""All signals by name, in the order of the loop."""


def _signal(name: str, unit: str, size: int, meaning: str, *fields: str, **others: Any) -> SignalType:
    SIGNALS[name] = SignalType(name, unit, size, meaning, fields, **others)
    return SIGNALS[name]


def _state(name: str, meaning: str, *fields: str, sequence: str = "") -> SignalType:
    units = ", ".join(STATE_UNITS)
    return _signal(name, units, N_STATES, meaning, *fields, components=STATE_NAMES, sequence=sequence)


def _input(name: str, meaning: str, *fields: str) -> SignalType:
    return _signal(name, ", ".join(INPUT_UNITS), N_INPUTS, meaning, *fields, components=INPUT_NAMES)


STATE = _state("state", "x, the true state", "state.altitude")
STATUS = _signal(
    "status",
    "1",
    1,
    "0: in flight, 1: finished, 2: diverged",
    "measurement.status",
    "state.status",
    "filtered_state.status",
)
FORCES = _signal(
    "forces",
    "N, N, N, N m, Pa",
    5,
    "forces on the vehicle",
    "forces.lift",
    components=("lift", "drag", "thrust", "pitching_moment", "dynamic_pressure"),
)
EFFECTOR = _input("effector", "positions of the effectors", "forces.effector")
AIR = _signal(
    "air",
    "m/s, m/s, 1",
    3,
    "wind, and density relative to the model atmosphere",
    "forces.wind_forward",
    components=("wind_forward", "wind_up", "density_factor"),
)
MEASUREMENT = _state("measurement", "y, the measured state", "measurement.state", "filtered_state.state")
ESTIMATE = _state("estimate", "x, estimated or measured", "filtered_state.estimate", sequence=f"{N_STATES}, or none")
FILTERED_PITCH_RATE = _signal(
    "filtered_pitch_rate", "rad/s", 1, "q_f, behind the notch filter", "filtered_state.filtered_pitch_rate"
)
FILTER_STATE = _signal(
    "filter_state",
    "rad, rad s",
    VARYING,
    "s, state of the notch filter before its update",
    "filtered_state.filter_state",
    sequence="two for each section of the notch filter",
)
REFERENCE = _state("reference", "x_r, the reference", "nominal.reference")
REFERENCE_INPUT = _input("reference_input", "u_r, input of the reference", "nominal.reference_input")
DEFECT = _state("defect", "d_r, defect of the reference")
DEVIATION = _state("deviation", "x_n, nominal deviation from the reference", "nominal.deviation")
NOMINAL_INPUT = _input("nominal_input", "u_n, nominal deviation from the input of the reference", "nominal.input")
GAIN = _signal(
    "gain",
    "",
    N_INPUTS * N_STATES,
    "K, if it was found in flight",
    "nominal.gain",
    sequence=f"{N_INPUTS * N_STATES}, or none",
)
GAIN_INDEX = _signal(
    "gain_index",
    "1",
    1,
    "number of the nominal gain K that gave u_n, 0 for that of the largest set, 255 for one found in flight",
    "nominal.gain_index",
)
NOMINAL_STATUS = _signal(
    "nominal_status",
    "1",
    1,
    "sum of 1: deviation outside all sets of the gains, 2: outside the envelope, 4 and 8: no solution in flight",
    "nominal.status",
)
UNSATURATED_INPUT = _input("wanted_input", "input before the limits")
COMMAND = _input("command", "u, within the limits", "command.fuel_equivalence_ratio")
SATURATED = _signal("saturated", "1", N_INPUTS, "whether the limits have changed each input", "command.saturated")
DIAGNOSTICS = _signal("diagnostics", "", VARYING, "numbers of the tube", "tube_status.level")
ACTUATOR = _input("actuator", "input that reaches the actuators", "actuator.fuel_equivalence_ratio")
ACTIVE_FAULTS = _signal("active_faults", "", VARYING, "faults that act", "actuator.active")

DIAGNOSED = {
    "level": 1,
    "u_nominal": N_INPUTS,
    "u_feedback": N_INPUTS,
    "u_unsaturated": N_INPUTS,
    "inside": 1,
    "status": 1,
    "error": VARYING,
    "tube_centre": VARYING,
    "tube_half_width": VARYING,
    "tau": VARYING,
}
"""Sizes of the controller's diagnostics by name; these are also the fields of the tube status."""


def numbers_of(signal: SignalType) -> list[tuple[str, str]]:
    """Return name and unit of every number in a signal: ``measurement.altitude`` in m, ``filter_state[1]`` in rad."""
    units = signal.unit.split(", ")
    components = SIGNALS[signal.name].components if signal.name in SIGNALS else ()
    if signal.size == 1 and not components:
        return [(signal.name, units[0])]
    names = [f".{name}" for name in components] or [f"[{i + 1}]" for i in range(signal.size)]
    return [(f"{signal.name}{name}", units[i % len(units)]) for i, name in enumerate(names)]


class Channel(NamedTuple):
    """One channel of the disturbance set W (eq. 19): its name, SI unit and meaning."""

    name: str
    unit: str
    meaning: str


CHANNELS = (
    Channel("acceleration", "m/s^2", "held acceleration along the velocity"),
    Channel("angle_of_attack_rate", "rad/s", "held rate of the angle of attack"),
    Channel("pitch_acceleration", "rad/s^2", "held pitch acceleration"),
    Channel("lost_elevator", "rad", "actuator less command; total elevator, trim included"),
    Channel("filtered_nominal_rate", "rad/s", "notch(q_n) - q_n, known from the plan"),
    Channel("altitude_residual", "m", "altitude that the accelerations do not explain, per period"),
    Channel("pitch_angle_residual", "rad", "pitch angle that the accelerations do not explain, per period"),
)
"""The channels of the disturbance set W, in the order of the columns of G in the error system."""

ACCELERATED, REMAINING = [1, 2, 4], [0, 3]
"""Indices of the rigid states whose derivatives the accelerations change, and of those with a residual channel."""


def first_step(time: float, period: float) -> int:
    """Return the first step k with k * ``period`` >= ``time`` (s), with a tolerance of 1e-9 steps for rounding."""
    return math.ceil(time / period - 1e-9)

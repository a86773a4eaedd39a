"""The signals of the loop with their names, units and sizes, and the conversion of times to steps."""

from __future__ import annotations

import math
from typing import NamedTuple

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


class SignalType(NamedTuple):
    """Type of a signal between blocks: name, unit and size."""

    name: str
    unit: str
    """SI unit, or ``"1"``; several, separated by commas, apply to the numbers in turn; empty for mixed contents"""
    size: int


def _state(name: str) -> SignalType:
    return SignalType(name, ", ".join(STATE_UNITS), N_STATES)


def _input(name: str) -> SignalType:
    return SignalType(name, ", ".join(INPUT_UNITS), N_INPUTS)


STATE = _state("state")
STATUS = SignalType("status", "1", 1)
FORCES = SignalType("forces", "N, N, N, N m, Pa", 5)
EFFECTOR = _input("effector")
AIR = SignalType("air", "m/s, m/s, 1", 3)
MEASUREMENT = _state("measurement")
ESTIMATE = _state("estimate")
FILTERED_PITCH_RATE = SignalType("filtered_pitch_rate", "rad/s", 1)
FILTER_STATE = SignalType("filter_state", "rad, rad s", VARYING)
REFERENCE = _state("reference")
REFERENCE_INPUT = _input("reference_input")
DEVIATION = _state("deviation")
NOMINAL_INPUT = _input("nominal_input")
GAIN = SignalType("gain", "", VARYING)
GAIN_INDEX = SignalType("gain_index", "1", 1)
NOMINAL_STATUS = SignalType("nominal_status", "1", 1)
UNSATURATED_INPUT = _input("wanted_input")
COMMAND = _input("command")
SATURATED = SignalType("saturated", "1", N_INPUTS)
DIAGNOSTICS = SignalType("diagnostics", "", VARYING)
ACTUATOR = _input("actuator")
ACTIVE_FAULTS = SignalType("active_faults", "", VARYING)

_COMPONENTS = {
    **dict.fromkeys(("state", "measurement", "estimate", "reference", "defect", "deviation"), STATE_NAMES),
    **dict.fromkeys(
        ("effector", "reference_input", "nominal_input", "wanted_input", "command", "actuator"), INPUT_NAMES
    ),
    "forces": ("lift", "drag", "thrust", "pitching_moment", "dynamic_pressure"),
    "air": ("wind_forward", "wind_up", "relative_density"),
}


def numbers_of(signal: SignalType) -> list[tuple[str, str]]:
    """Return name and unit of every number in a signal: ``measurement.altitude`` in m, ``filter_state[1]`` in rad."""
    units = signal.unit.split(", ")
    if signal.size == 1 and signal.name not in _COMPONENTS:
        return [(signal.name, units[0])]
    names = [f".{name}" for name in _COMPONENTS.get(signal.name, ())] or [f"[{i + 1}]" for i in range(signal.size)]
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

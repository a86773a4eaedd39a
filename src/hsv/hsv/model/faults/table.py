"""All kinds of faults with their channels and parameters, from which the parser, help and documentation follow.

The side of a fault is where it acts: on the command before the actuator, on the dynamics of the actuator, on the
effector moved by it, on the engine, or on a sensor. Faults that act at the same time are composed in the order of
:data:`FAULT_KINDS`, whatever the order in which they are listed. Of several that replace the position of an effector,
the one that started last prevails. Every kind may be intermittent, see :data:`OCCURRENCE_PARAMETERS`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Self

from hsv.base.errors import ParameterError, one_of
from hsv.base.parameters import Parameter, read_number
from hsv.base.units import UnitSystem, parse_quantity, readable
from hsv.core import compare_enumerators, lib
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS

ENGINE = "engine"
"""Name of the channel for faults of the engine."""


@dataclass(frozen=True)
class Channel:
    """A channel on which faults can act: its SI unit, and a typical travel, with which parameter ranges are scaled."""

    unit: str
    travel: float


_STOP = parse_quantity("30 deg", "rad", "stop")
"""Stop of the elevator (rad), with the same bits as "30 deg" in a file."""

CHANNELS = {
    **{
        name: Channel("" if unit == "1" else unit, travel)
        for name, unit, travel in zip(INPUT_NAMES, INPUT_UNITS, (1.5, _STOP), strict=True)
    },
    ENGINE: Channel("", 1.0),
    **{
        name: Channel(unit, travel)
        for name, unit, travel in zip(
            STATE_NAMES, STATE_UNITS, (3000.0, 300.0, 0.5, 0.5, 1.0, 30.0, 500.0, 30.0, 500.0), strict=True
        )
    },
}
"""Channels by name: the control inputs, the engine, and the states, whose sensors can fail."""

COMMAND, DYNAMICS, EFFECTOR, ENGINE_SIDE, SENSOR = "command", "dynamics", "effector", "engine", "sensor"


@dataclass(frozen=True)
class FaultParameter:
    """A parameter of a kind of fault. ``{}`` in ``unit`` stands for the channel's unit.

    With ``{}``, ``minimum`` and ``maximum`` are multiples of the channel's travel.
    """

    name: str
    description: str
    unit: str
    minimum: float
    maximum: float
    default: float | None = None
    """Default value, or None if the parameter must be given."""
    whole: bool = False

    def of(self, channel: str) -> Parameter:
        """Return the parameter for a ``channel``, with the unit and the range that it has there."""
        described = CHANNELS[channel]
        own = "{}" in self.unit
        scale = described.travel if own else 1.0
        unit = self.unit.replace("{}", described.unit or "1") if own else self.unit
        return Parameter(
            self.name,
            self.minimum * scale if self.default is None else self.default,
            self.description,
            "" if unit == "1" else unit,
            self.minimum * scale,
            self.maximum * scale,
            whole=self.whole,
        )

    def written(self, channel: str, value: float, system: UnitSystem = UnitSystem.metric) -> str:
        """Return ``value`` (SI), for a fault of ``channel``, as text with its unit in ``system``."""
        # Angles are read in degrees, but natural frequencies in rad/s.
        given = UnitSystem.si if self.unit == "rad/s" else system
        return readable(value, self.of(channel).unit or "1", given)


@dataclass(frozen=True)
class FaultKind:
    """A kind of fault: code and enumerator in the core, meaning, own parameters, side and possible channels.

    The code selects the random numbers of intermittent faults: it never changes, and a new kind gets the next number,
    wherever it stands in :data:`FAULT_KINDS`. A kind that ``replaces`` sets the position of an effector.
    """

    code: int
    enumerator: str
    meaning: str
    parameters: tuple[FaultParameter, ...] = ()
    side: str = COMMAND
    channels: tuple[str, ...] = INPUT_NAMES
    replaces: bool = False


_P = FaultParameter
_WIDTH = _P("width", "total width", "{}", 0.0, 1.0)
_OSCILLATION = (
    _P("amplitude", "amplitude", "{}", 0.0, 1.0),
    _P("frequency", "frequency", "Hz", 1e-3, 100.0),
    _P("phase", "phase at the start of the fault", "rad", -10.0, 10.0, 0.0),
)
_GROWING_OFFSET = (
    _P("rate", "rate of the offset; its sign is that of the offset", "{}/s", -10.0, 10.0),
    _P("limit", "largest offset", "{}", 0.0, 1.0),
)
_UNSTART = (
    _P("thrust_factor", "thrust that remains", "", 0.0, 1.0, 0.0),
    _P("lift_factor", "lift, relative to the started inlet", "", 0.0, 2.0, 0.8),
    _P("drag_factor", "drag, relative to the started inlet", "", 0.0, 5.0, 1.2),
    _P("moment_zero", "increment of the pitching moment coefficient", "", -0.5, 0.5, 0.045),
    _P("moment_alpha", "increment of that coefficient per angle of attack", "1/rad", -5.0, 5.0, 0.0),
)
_OUTSIDE = (
    _P("angle_of_attack", "centre of the region where the inlet stays started", "rad", -0.5, 0.5, 0.0),
    _P("angle_of_attack_reach", "half axis of that region", "rad", 1e-3, 10.0, 10.0),
    _P("mach", "centre of that region", "", 0.0, 30.0, 8.0),
    _P("mach_reach", "half axis of that region", "", 1e-2, 100.0, 100.0),
    _P("fuel_limit", "fuel equivalence ratio above which the inlet unstarts", "", 0.0, 10.0, 10.0),
    _P("hysteresis", "share of region and limit that must be regained for a restart", "", 0.0, 0.9, 0.1),
    _P("restart_time", "least time for which the inlet stays unstarted", "s", 0.0, 1e4, 0.0),
)

_ABOUT_START = "0: the whole command is reversed, 1: only its change since the start of the fault"

_dynamics = partial(FaultKind, side=DYNAMICS)
_effector = partial(FaultKind, side=EFFECTOR)
_replacing = partial(FaultKind, side=EFFECTOR, replaces=True)
_engine = partial(FaultKind, side=ENGINE_SIDE, channels=(ENGINE,))
_sensor = partial(FaultKind, side=SENSOR, channels=STATE_NAMES)

FAULT_KINDS = {
    "loss_of_effectiveness": FaultKind(
        0,
        "LOSS",
        "the actuator receives effectiveness times the command (paper eq. 15); effectiveness may be lost over a ramp",
        (
            _P("effectiveness", "share of the command that remains", "", 0.0, 1.0),
            _P("ramp_time", "time over which effectiveness is lost; 0: at once", "s", 0.0, 1e4, 0.0),
        ),
    ),
    "reversal": FaultKind(
        1, "REVERSAL", "the command is multiplied by -1", (_P("about_start", _ABOUT_START, "", 0.0, 1.0, 0.0),)
    ),
    "delay": FaultKind(
        2,
        "DELAY",
        "the actuator receives the command with a delay; at first it receives the one at the start of the fault",
        (_P("steps", "delay in control periods", "", 1.0, float(lib.MAX_DELAY), whole=True),),
    ),
    "dead_zone": FaultKind(
        3, "DEAD_ZONE", "commands within a dead zone about the one at the start of the fault have no effect", (_WIDTH,)
    ),
    "backlash": FaultKind(
        4, "BACKLASH", "there is play between command and actuator, centred at the start of the fault", (_WIDTH,)
    ),
    "bandwidth": _dynamics(
        5,
        "BANDWIDTH",
        "the natural frequency is reduced; an ideal actuator becomes a first-order lag",
        (_P("natural_frequency", "largest natural frequency", "rad/s", 0.1, 1e3),),
    ),
    "rate_limit": _dynamics(
        6, "RATE_LIMIT", "the rate of the actuator is limited", (_P("rate", "largest rate", "{}/s", 1e-4, 100.0),)
    ),
    "stop_limit": _dynamics(
        7,
        "STOP_LIMIT",
        "the travel of the actuator is limited; from a position beyond the limits it returns at its largest rate",
        (_P("lower", "least position", "{}", -1.0, 1.0), _P("upper", "largest position", "{}", -1.0, 1.0)),
    ),
    "effector_scale": _effector(
        8,
        "SCALE",
        "the position of the effector is a multiple of that of the actuator",
        (_P("factor", "multiple", "", -1.0, 2.0),),
    ),
    "bias": _effector(
        9,
        "BIAS",
        "a constant offset is added to the position of the effector",
        (_P("offset", "offset of the position", "{}", -1.0, 1.0),),
    ),
    "drift": _effector(
        10,
        "DRIFT",
        "an offset that grows at a constant rate up to a limit is added to the position of the effector",
        _GROWING_OFFSET,
    ),
    "oscillation": _effector(
        11, "OSCILLATION", "an oscillation is added to the position of the effector (liquid failure)", _OSCILLATION
    ),
    "lock_in_place": _replacing(12, "LOCK", "the effector stays at its position at the start of the fault"),
    "lock_at": _replacing(
        13, "LOCK_AT", "the effector stays at a given position", (_P("position", "position", "{}", -1.0, 1.0),)
    ),
    "float": _replacing(
        14,
        "FLOAT",
        "the effector moves freely: no force at zero deflection, or along the flow",
        (_P("alignment", "0: zero deflection, 1: minus the angle of attack", "", 0.0, 1.0, 0.0),),
        channels=INPUT_NAMES[1:],
    ),
    "hard_over": _replacing(
        15,
        "HARD_OVER",
        "the effector moves to a stop and stays there",
        (_P("rate", "rate of the motion; its sign selects the stop", "{}/s", -100.0, 100.0),),
    ),
    "solid_oscillation": _replacing(
        16,
        "SOLID_OSCILLATION",
        "the effector oscillates about its position at the start of the fault, whatever the command (solid failure)",
        _OSCILLATION,
    ),
    "thrust_loss": _engine(
        17,
        "THRUST_LOSS",
        "only a share of the thrust remains",
        (_P("share", "share that remains", "", 0.0, 1.0),),
    ),
    "inlet_unstart": _engine(18, "UNSTART", "the inlet is unstarted: thrust, lift, drag and moment change", _UNSTART),
    "inlet_unstart_outside": _engine(
        19,
        "UNSTART_OUTSIDE",
        "the inlet unstarts where angle of attack and Mach number leave an ellipse, or fuel exceeds a limit",
        (*_UNSTART, *_OUTSIDE),
    ),
    "sensor_scale": _sensor(
        20,
        "SENSOR_SCALE",
        "the output of the sensor is multiplied by a factor",
        (_P("factor", "factor", "", -1.0, 2.0),),
    ),
    "sensor_noise": _sensor(
        21,
        "SENSOR_NOISE",
        "white noise is added to the output of the sensor",
        (_P("standard_deviation", "standard deviation of the noise", "{}", 0.0, 1.0),),
    ),
    "sensor_bias": _sensor(
        22,
        "SENSOR_BIAS",
        "a constant offset is added to the output of the sensor",
        (_P("offset", "offset, measurement minus truth", "{}", -1.0, 1.0),),
    ),
    "sensor_runaway": _sensor(
        23,
        "SENSOR_RUNAWAY",
        "an offset that grows at a constant rate up to a limit is added to the output of the sensor",
        _GROWING_OFFSET,
    ),
    "sensor_drop_out": _sensor(
        24,
        "SENSOR_DROP_OUT",
        "samples are lost at random; the last one is held",
        (_P("probability", "probability that a sample is lost", "", 0.0, 1.0),),
    ),
    "sensor_freeze": _sensor(
        25, "SENSOR_FREEZE", "the output of the sensor stays at its value at the start of the fault"
    ),
}
"""All kinds of faults by name, in the order in which faults that act at the same time are composed."""

compare_enumerators("hsv_fault_kind", {kind.enumerator: kind.code for kind in FAULT_KINDS.values()})

OCCURRENCE_PARAMETERS = (
    _P("intermittent_period", "the fault comes and goes with this period; 0: it stays", "s", 0.0, 1e4, 0.0),
    _P("intermittent_duty", "share of the period during which the fault acts", "", 0.0, 1.0, 0.5),
    _P("random_on", "mean of the random time for which the fault acts; 0: it stays", "s", 0.0, 1e4, 0.0),
    _P("random_off", "mean of the random time between", "s", 0.0, 1e4, 0.0),
)
"""Parameters of all kinds: a fault acts always, periodically or as a Markov chain, between its start and stop."""


def fault_parameters(channel: str, kind: str) -> tuple[FaultParameter, ...]:
    """Return the parameters of a kind of fault, followed by :data:`OCCURRENCE_PARAMETERS`.

    Raises:
        ParameterError: The kind is unknown or does not exist for the channel.
    """
    if kind not in FAULT_KINDS:
        raise ParameterError(f"fault.type = {kind!r}: expected {one_of(FAULT_KINDS, kind)}")
    described = FAULT_KINDS[kind]
    if channel not in described.channels:
        choices = one_of(described.channels, channel, f" for {kind}")
        raise ParameterError(f"fault.channel = {channel!r}: expected {choices}")
    return (*described.parameters, *OCCURRENCE_PARAMETERS)


@dataclass(frozen=True)
class Fault:
    """A fault of one channel; ``values`` (SI) are those of :func:`fault_parameters`, in the same order.

    Raises:
        ParameterError: The kind is unknown or does not exist for the channel, or a value is not admissible.
    """

    channel: str
    type: str
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        table = fault_parameters(self.channel, self.type)
        for parameter, value in zip(table, self.values, strict=True):
            described = parameter.of(self.channel)
            given = float(value) if isinstance(value, int) and not isinstance(value, bool) else value
            try:
                described.check(given)
            except ParameterError as error:
                raise ParameterError(str(error).replace("parameter ", "fault.", 1)) from error
        named = dict(zip((p.name for p in table), self.values, strict=True))
        if self.type == "hard_over" and not named["rate"]:
            raise ParameterError("fault.rate = 0: expected a rate whose sign selects the stop")
        if named.get("lower", 0.0) > named.get("upper", math.inf):
            known = {parameter.name: parameter for parameter in table}
            lower, upper = (known[end].written(self.channel, named[end]) for end in ("lower", "upper"))
            raise ParameterError(f"fault.lower = {lower}: expected at most upper, {upper}")
        cycle, on, off = (named[name] for name in ("intermittent_period", "random_on", "random_off"))
        if cycle and (on or off):
            raise ParameterError(f"fault.intermittent_period = {cycle:g} s: expected 0 s with random_on or random_off")
        if bool(on) != bool(off):
            raise ParameterError(f"fault.random_off = {off:g} s: expected above 0 s where random_on is, and only there")

    @classmethod
    def of(cls, channel: str, kind: str, parameters: Mapping[str, float]) -> Self:
        """Return a fault from its ``parameters`` (SI) by name; those with a default may be left out."""
        table = fault_parameters(channel, kind)
        optional = {p.name: p.default for p in table if p.default is not None}
        due = [p.name for p in table if p.default is None]
        for name in parameters:
            if name not in optional and name not in due:
                choices = one_of((*due, *optional), name, f" for {kind}")
                raise ParameterError(f"fault.{name}: unknown parameter, expected {choices}")
        for name in due:
            if name not in parameters:
                raise ParameterError(f"fault.{name}: missing, expected {' and '.join(due)} for {kind}")
        given = {**optional, **parameters}
        if "intermittent_duty" in parameters and not given["intermittent_period"]:
            raise ParameterError("fault.intermittent_duty: has no effect, expected an intermittent_period above 0 s")
        return cls(channel, kind, tuple(given[p.name] for p in table))

    def check_period(self, period: float) -> None:
        """Check that the fault's ``intermittent_period``, unless it is 0, is at least the control ``period`` (s).

        Raises:
            ParameterError: It is shorter; the message names the parameter.
        """
        cycle = self.parameters.get("intermittent_period", math.inf)
        if cycle < period:
            raise ParameterError(f"fault.intermittent_period = {cycle:g} s: expected 0 s or at least {period:g} s")

    def __str__(self) -> str:
        known = {parameter.name: parameter for parameter in fault_parameters(self.channel, self.type)}
        words = ", ".join(
            # "loss_of_effectiveness 0.8 of ..." needs no second "effectiveness".
            ("" if self.type.endswith(name) else f"{name} ") + known[name].written(self.channel, value)
            for name, value in self.parameters.items()
        )
        return f"{self.type} {words + ' ' if words else ''}of {self.channel}"

    @property
    def kind(self) -> FaultKind:
        """The kind of the fault."""
        return FAULT_KINDS[self.type]

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters (SI) by name, without those at their defaults."""
        table = fault_parameters(self.channel, self.type)
        return {p.name: value for p, value in zip(table, self.values, strict=True) if value != p.default}


def read_fault(channel: str, kind: str, parameters: Sequence[str]) -> Fault:
    """Return the fault whose ``parameters`` are texts ``name=quantity``; a single required one needs no name."""
    known = {parameter.name: parameter.of(channel) for parameter in fault_parameters(channel, kind)}
    due = [parameter.name for parameter in FAULT_KINDS[kind].parameters if parameter.default is None]
    given = {}
    for text in parameters:
        name, equals, quantity = text.partition("=")
        if not equals and len(due) == 1:
            name, quantity = due[0], text
        if name not in known:
            raise ParameterError(f"fault.{name}: unknown parameter, expected {one_of(known, name)}")
        given[name] = read_number(known[name], quantity, f"fault.{name}")
    return Fault.of(channel, kind, given)

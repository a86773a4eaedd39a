"""Which field of which message holds which signal of the loop, as one table, and the functions made of it.

Here messages are objects with the fields of their type as attributes, such as those of a bag's own definitions, which
the replay reads and fills in place. The nodes make and take the bytes by the same table, see ``hsv_node.wire``. In both
a message becomes straight-line code, for which the table gives the expressions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hsv import signals as types
from hsv.errors import ParameterError
from hsv.graph.description import (
    ACTUATOR,
    CLOCK,
    COMMAND,
    FILTERED_STATE,
    FORCES,
    MEASUREMENT,
    NOMINAL,
    STATE,
    TUBE_STATUS,
)
from hsv.simulation.blocks import LOOP
from hsv.vehicle.dynamics import INPUT_NAMES

if TYPE_CHECKING:
    from hsv.faults.schedule import ActiveFault
    from hsv.faults.table import Fault
    from hsv.simulation.blocks import Signals

Message = Any


class Head(NamedTuple):
    """Header of a message: time, and its frame as a text with its length."""

    sec: int
    nanosec: int
    length: int = 1
    frame: bytes = b"\0"

    @property
    def stamp(self) -> Head:
        """The time: what has ``sec`` and ``nanosec``."""
        return self

    @property
    def frame_id(self) -> str:
        """The frame as text."""
        return self.frame[:-1].decode(errors="replace")

    @classmethod
    def at(cls, step: int, period: float) -> Head:
        """Return that of a ``step`` in a flight with a ``period`` (s)."""
        return cls(*stamp_of(step, period))


def stamp_of(step: int, period: float) -> tuple[int, int]:
    """Return seconds and nanoseconds of simulated time at ``step``."""
    return divmod(round(step * period * 1e9), 1_000_000_000)


class Form(NamedTuple):
    """How a signal stands in a message; both functions also take the signal :attr:`Row.beside` it, where there is one.

    Of a sequence they give and take all numbers, else one number for each field.
    """

    values: Callable[..., Any]
    """Returns the numbers of a signal, in the order of the fields."""
    signal: Callable[..., Any]
    """Returns the signal of these numbers."""
    sequence: bool = False


class Row(NamedTuple):
    """A signal in a message."""

    signal: str
    """Attribute of :class:`hsv.simulation.blocks.Signals`, or of one of its attributes."""
    fields: tuple[str, ...]
    """Attributes of the message or elements of them, in the order of its type."""
    form: Form | None = None
    """None: the signal is the number in the one field."""
    beside: str = ""

    def given(self, i: int) -> str:
        """Return the expression of what the fields of the row with number ``i`` are set to."""
        signals = ", ".join(f"signals.{name}" for name in (self.signal, self.beside) if name)
        return f"values_{i}({signals})" if self.form else signals

    def taken(self, i: int, values: str) -> str:
        """Return the statement that sets the signal of the row with number ``i`` from the expression of its numbers."""
        beside = f", signals.{self.beside}" if self.beside else ""
        return f"signals.{self.signal} = " + (f"signal_{i}({values}{beside})" if self.form else values)


_VECTOR = Form(np.ndarray.tolist, np.array)
_TUPLE = Form(tuple, tuple)
_SEQUENCE = Form(np.ndarray.tolist, np.array, sequence=True)
_MATRIX = Form(lambda matrix: matrix.ravel().tolist(), np.array, sequence=True)
_ESTIMATE = Form(
    lambda estimate, measurement: [] if estimate is measurement else estimate.tolist(),
    lambda values, measurement: np.array(values) if len(values) else measurement,
    sequence=True,
)

_swapped = itemgetter(0, 1, 2, 3, 4, 5, 7, 6, 8)
"""From the order of x to that of LongitudinalState, whose elastic coordinates come before their rates, and back."""
_STATE = Form(lambda x: _swapped(x.tolist()), lambda values: np.array(_swapped(values)))
_STATE_FIELDS = (
    "altitude",
    "velocity",
    "angle_of_attack",
    "pitch_angle",
    "pitch_rate",
    "elastic_coordinate[0]",
    "elastic_coordinate[1]",
    "elastic_rate[0]",
    "elastic_rate[1]",
)


class _Fault(NamedTuple):
    """A message Fault."""

    channel: str
    type: str
    parameter_names: list[str]
    parameter_values: np.ndarray


def fault_in(message: Message) -> Fault:
    """Return the fault in a message Fault.

    Raises:
        ParameterError: An unknown channel, type or parameter, or a value that is not admitted.
    """
    from hsv.faults.table import Fault  # of most nodes, none needs it

    names, values = message.parameter_names, message.parameter_values
    if len(names) != len(values):
        raise ParameterError(f"fault.parameter_values: {len(values)} values, expected one a name, {len(names)}")
    return Fault.of(message.channel, message.type, dict(zip(names, map(float, values), strict=True)))


def active_faults(message: Message) -> tuple[ActiveFault, ...]:
    """Return the faults in a message Actuator, with their first steps.

    Raises:
        ParameterError: See :func:`fault_in`.
    """
    return _faults((message.active, message.since))


def _faults(values: tuple[Iterable[Message], Iterable[int]]) -> tuple[ActiveFault, ...]:
    from hsv.faults.schedule import ActiveFault

    return tuple(ActiveFault(fault_in(fault), int(since)) for fault, since in zip(*values, strict=True))


def _said_of(faults: tuple[ActiveFault, ...]) -> tuple[list[_Fault], np.ndarray]:
    return (
        [
            _Fault(fault.channel, fault.type, [*fault.parameters], np.array([*fault.parameters.values()]))
            for fault, _ in faults
        ],
        np.array([since for _, since in faults], np.uint64),
    )


FAULTS = Form(_said_of, _faults)
"""Two sequences, of messages and of numbers."""


def _state(signal: str, within: str = "") -> Row:
    return Row(signal, tuple(within + name for name in _STATE_FIELDS), _STATE)


def _input(signal: str, within: str = "") -> Row:
    return Row(signal, tuple(within + name for name in INPUT_NAMES), _VECTOR)


HELD: Mapping[str, tuple[Row, ...]] = {
    MEASUREMENT: (_state("measurement", "state."), Row("status", ("status",))),
    STATE: (_state("state"), Row("status", ("status",))),
    FORCES: (
        Row("forces", ("lift", "drag", "thrust", "pitching_moment", "dynamic_pressure"), _TUPLE),
        _input("effector", "effector."),
        Row("air", ("wind_forward", "wind_up", "density_factor"), _VECTOR),
    ),
    FILTERED_STATE: (
        _state("measurement", "state."),
        Row("filtered_pitch_rate", ("filtered_pitch_rate",)),
        Row("filter_state", ("filter_state",), _SEQUENCE),
        Row("estimate", ("estimate",), _ESTIMATE, beside="measurement"),
        Row("status", ("status",)),
    ),
    NOMINAL: (
        _state("reference", "reference."),
        _input("reference_input", "reference_input."),
        _state("deviation", "deviation."),
        _input("nominal_input", "input."),
        Row("gain", ("gain",), _MATRIX),
        Row("gain_index", ("gain_index",)),
        Row("nominal_status", ("status",)),
    ),
    COMMAND: (_input("command"), Row("saturated", ("saturated[0]", "saturated[1]"), _VECTOR)),
    TUBE_STATUS: (
        Row("diagnostics.error", ("error",), _SEQUENCE),
        Row("diagnostics.tube_centre", ("tube_centre",), _SEQUENCE),
        Row("diagnostics.tube_half_width", ("tube_half_width",), _SEQUENCE),
        Row("diagnostics.level", ("level",)),
        Row("diagnostics.inside", ("inside",)),
        _input("diagnostics.u_nominal", "u_nominal."),
        _input("diagnostics.u_feedback", "u_feedback."),
        _input("reference_input", "u_reference."),
        _input("diagnostics.u_unsaturated", "u_unsaturated."),
        Row("diagnostics.tau", ("tau",), _SEQUENCE),
        Row("diagnostics.status", ("status",)),
    ),
    ACTUATOR: (_input("actuator"), Row("active_faults", ("active", "since"), FAULTS)),
}
"""The signals in the messages of a step by topic, behind header and step, in the order of the type; the clock's is the
stamp of a header alone."""

NEEDED = {signal.name for block in LOOP for signal in (*block.inputs, *block.delayed, *block.state)}
NEEDED.add(types.STATUS.name)
"""The signals that are taken from messages: those that a block needs, and the status, which is passed on."""


def function(topic: str, arguments: str, statements: Iterable[str], **names: Any) -> Callable[..., Any]:
    """Return the function of these statements, which know ``names`` and the forms of the rows of a topic."""
    known: dict[str, Any] = {}
    for i, row in enumerate(HELD.get(topic, ())):
        if row.form:
            known |= {f"values_{i}": row.form.values, f"signal_{i}": row.form.signal}
    known |= names
    exec(f"def made({arguments}):\n    " + "\n    ".join(statements), known)
    made: Callable[..., Any] = known["made"]
    return made


@cache
def reader(topic: str) -> Callable[[Message, Signals], None]:
    """Return the function from a topic's message to the signals that a block needs."""
    statements = ["signals.header, signals.step = message.header, message.step"]
    for i, row in enumerate(HELD[topic]):
        values = ", ".join(f"message.{field}" for field in row.fields)
        if row.form is _ESTIMATE:  # bags from before there were estimators lack the field
            values = f"getattr(message, {row.fields[0]!r}, ())"
        elif row.form and not row.form.sequence:
            values = f"({values})"
        if row.signal in NEEDED:
            statements.append(row.taken(i, values))
    return function(topic, "message, signals", statements)


@cache
def filler(topic: str) -> Callable[[Signals, Message], None]:
    """Return the function from the signals, whose header is a Head or a message's, to a topic's message."""
    if topic == CLOCK:
        return function(topic, "signals, message", ["message.clock = signals.header.stamp"])
    statements = ["message.header, message.step = signals.header, signals.step"]
    for i, row in enumerate(HELD[topic]):
        targets = ", ".join(f"message.{field}" for field in row.fields)
        values = f"array({row.given(i)})" if row.form and row.form.sequence else row.given(i)
        statements.append(f"{targets} = {values}")
    return function(topic, "signals, message", statements, array=np.array)

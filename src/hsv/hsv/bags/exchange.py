"""Which field of which message holds which signal of the loop, as one table, and the functions made of it.

Here messages are objects with the fields of their type as attributes, such as those of a bag's own definitions, which
the replay reads and fills in place. The nodes make and take the bytes by the same table, see ``hsv_node.wire``. In both
a message becomes straight-line code, for which the table gives the expressions. That which reads ``hsv/actuator`` is::

    def made(message, signals):
        header, step = message.header, message.step
        actuator = signal_0((message.fuel_equivalence_ratio, message.elevator_deflection))
        active_faults = signal_1((message.active, message.since))
        signals.header, signals.step, signals.actuator, signals.active_faults = header, step, actuator, active_faults

where ``signal_0`` and ``signal_1`` are those of the forms of its two rows. No signal is set before all are known, so
that a message that is refused leaves none of it behind.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from functools import cache
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from hsv.bags.description import (
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
from hsv.base.errors import ParameterError, SignalError
from hsv.flight.blocks import LOOP
from hsv.model import signals as types
from hsv.model.signals import INPUT_NAMES, N_INPUTS, N_STATES, NEVER

if TYPE_CHECKING:
    from hsv.flight.blocks import Signals
    from hsv.model.faults.schedule import ActiveFault
    from hsv.model.faults.table import Fault

Message = Any


class Head(NamedTuple):
    """Header of a message, flat as it stands in its bytes: the two numbers of the time, and the frame as a text.

    It reads as a header that is an object, too, with ``stamp.sec``, ``stamp.nanosec`` and ``frame_id``.
    """

    sec: int
    nanosec: int
    length: int = 1
    frame: bytes = b"\0"

    @property
    def stamp(self) -> Head:
        """The time. Its two numbers are attributes of the head itself, so that no further object is made of them."""
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


class Sizes(NamedTuple):
    """How many numbers a sequence may have."""

    admitted: Container[int]
    words: str
    """What is said to be expected where it has others."""


class Form(NamedTuple):
    """How a signal stands in a message; both functions also take the signal :attr:`Row.beside` it, where there is one.

    Of a sequence they give and take all numbers, else one number for each field.
    """

    values: Callable[..., Any]
    """Returns the numbers of a signal, in the order of the fields."""
    signal: Callable[..., Any]
    """Returns the signal of these numbers.

    Raises:
        SignalError: It cannot be made of them.
    """
    sequence: bool = False
    sizes: Sizes | None = None
    """Of a sequence, None for any."""


class Row(NamedTuple):
    """A signal in a message."""

    signal: str
    """Attribute of :class:`hsv.flight.blocks.Signals`, or of one of its attributes."""
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
        """Return the statement that makes the signal of the row with number ``i`` from the expression of its numbers.

        It is a variable of the signal's name, and so is the one beside it.
        """
        beside = f", {self.beside}" if self.beside else ""
        return f"{self.signal} = " + (f"signal_{i}({values}{beside})" if self.form else values)

    def refuse(self, size: int) -> NoReturn:
        """Refuse the sequence of the row for its ``size``.

        Raises:
            SignalError: Always.
        """
        assert self.form and self.form.sizes
        raise SignalError(self.signal, f"{self.fields[0]}: {size} numbers, expected {self.form.sizes.words}")


_VECTOR = Form(np.ndarray.tolist, np.array)
_TUPLE = Form(tuple, tuple)
_SEQUENCE = Form(np.ndarray.tolist, np.array, sequence=True)
_SECTIONS = _SEQUENCE._replace(sizes=Sizes(range(0, 2**32, 2), "two a section of the notch filter"))
_GAIN = Form(
    lambda matrix: matrix.ravel().tolist(),
    np.array,
    sequence=True,
    sizes=Sizes((0, N_INPUTS * N_STATES), f"{N_INPUTS * N_STATES}, or none"),
)
_ESTIMATE = Form(
    lambda estimate, measurement: [] if estimate is measurement else estimate.tolist(),
    lambda values, measurement: np.array(values) if len(values) else measurement,
    sequence=True,
    sizes=Sizes((0, N_STATES), f"{N_STATES}, or none"),
)
_ADDED = ("estimate", "gain")
"""Sequences that the messages of older bags lack, which is as if they were empty."""

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
    from hsv.model.faults.table import Fault  # of most nodes, none needs it

    names, values = message.parameter_names, message.parameter_values
    if len(names) != len(values):
        raise ParameterError(f"fault.parameter_values: {len(values)} values, expected one a name, {len(names)}")
    return Fault.of(message.channel, message.type, dict(zip(names, map(float, values), strict=True)))


def active_faults(message: Message) -> tuple[ActiveFault, ...]:
    """Return the faults in a message Actuator, with their first steps.

    Raises:
        SignalError: See :func:`fault_in`; or there are not as many first steps, or none of a flight.
    """
    return _faults((message.active, message.since))


def _faults(values: tuple[Sequence[Message], Sequence[int]]) -> tuple[ActiveFault, ...]:
    from hsv.model.faults.schedule import ActiveFault

    active, since = values
    if len(active) != len(since):
        raise SignalError("active_faults", f"since: {len(since)} steps, expected one a fault in active, {len(active)}")
    made = []
    for i, (message, first) in enumerate(zip(active, map(int, since), strict=True)):
        try:
            made.append(ActiveFault(fault_in(message), first))
        except ParameterError as error:
            raise SignalError("active_faults", f"active[{i}]: {error}") from error
        if first > NEVER:
            raise SignalError("active_faults", f"since[{i}] = {first}: expected a step, at most {NEVER}")
    return tuple(made)


def _fault_messages(faults: tuple[ActiveFault, ...]) -> tuple[list[_Fault], np.ndarray]:
    return (
        [
            _Fault(fault.channel, fault.type, [*fault.parameters], np.array([*fault.parameters.values()]))
            for fault, _ in faults
        ],
        np.array([since for _, since in faults], np.uint64),
    )


FAULTS = Form(_fault_messages, _faults)
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
        Row("filter_state", ("filter_state",), _SECTIONS),
        Row("estimate", ("estimate",), _ESTIMATE, beside="measurement"),
        Row("status", ("status",)),
    ),
    NOMINAL: (
        _state("reference", "reference."),
        _input("reference_input", "reference_input."),
        _state("deviation", "deviation."),
        _input("nominal_input", "input."),
        Row("gain", ("gain",), _GAIN),
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
            if row.form.sizes:
                known |= {f"sizes_{i}": row.form.sizes.admitted, f"refuse_{i}": row.refuse}
    known |= names
    exec(f"def made({arguments}):\n    " + "\n    ".join(statements), known)
    made: Callable[..., Any] = known["made"]
    return made


def taking(topic: str, head: str, fields: Iterable[tuple[str, str]]) -> Iterator[str]:
    """Yield the statements that take from a topic's message the signals that a block needs.

    Args:
        topic: The topic.
        head: Expressions of header and step.
        fields: By row, the expressions of its numbers and, of a sequence, of how many there are.
    """
    yield f"header, step = {head}"
    taken = ["header", "step"]
    for i, (row, (values, size)) in enumerate(zip(HELD[topic], fields, strict=True)):
        if row.form and row.form.sizes:
            yield f"if {size} not in sizes_{i}: refuse_{i}({size})"
        if row.signal in NEEDED:
            yield row.taken(i, values)
            taken.append(row.signal)
    yield f"{', '.join(f'signals.{name}' for name in taken)} = {', '.join(taken)}"


@cache
def reader(topic: str) -> Callable[[Message, Signals], None]:
    """Return the function from a topic's message to the signals that a block needs.

    It raises a :class:`hsv.base.errors.SignalError` where they cannot be made of it, and leaves the signals as they
    are.
    """

    def fields(row: Row) -> tuple[str, str]:
        if row.signal in _ADDED:
            values = f"getattr(message, {row.fields[0]!r}, ())"
        else:
            values = ", ".join(f"message.{field}" for field in row.fields)
        sequence = row.form is not None and row.form.sequence
        return f"({values})" if row.form and not sequence else values, f"len({values})" if sequence else ""

    head = "message.header, message.step"
    return function(topic, "message, signals", taking(topic, head, map(fields, HELD[topic])))


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

"""Step messages straight from the signals of the loop, and back: what a step of the graph spends least time on.

:mod:`hsv.graph.exchange` does the same with messages as objects. Here a message is the flat tuple of all that stands in
it, in the order of its type, lengths of texts and sequences included, as :meth:`hsv_node.codec.Codec.unpack` gives it;
no object is made for it. Both have the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from hsv.faults.schedule import ActiveFault
from hsv.graph.description import (
    ACTUATOR,
    CLOCK,
    COMMAND,
    FILTERED_STATE,
    FORCES,
    MEASUREMENT,
    NOMINAL,
    STATE,
    TOPICS,
    TUBE_STATUS,
)
from hsv.graph.exchange import stamp_of
from hsv.simulation.blocks import Signals
from hsv_node.codec import codec

Values = tuple[Any, ...]
"""What stands in a message, behind its encapsulation; the header comes first, in every one but the clock's."""


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

    @classmethod
    def at(cls, step: int, period: float) -> Head:
        """Return that of a ``step`` in a flight with a ``period`` (s)."""
        return cls(*stamp_of(step, period))


_HEAD = slice(1, 5)
STEP_PLACE = 5
_FIRST = 6
"""Places of the header, of the step and of what comes behind them; at 0 is the encapsulation."""


def head_of(values: Values) -> Head:
    """Return the header of a message."""
    return Head._make(values[_HEAD])


def _state_at(values: Values, place: int) -> np.ndarray:
    """Return x (9) of a LongitudinalState, whose elastic coordinates come before their rates."""
    h, V, alpha, theta, q, c_1, c_2, r_1, r_2 = values[place : place + 9]
    return np.array((h, V, alpha, theta, q, c_1, r_1, c_2, r_2))


def _state(x: np.ndarray) -> Values:
    h, V, alpha, theta, q, c_1, r_1, c_2, r_2 = x.tolist()
    return h, V, alpha, theta, q, c_1, c_2, r_1, r_2


def _place(values: Values, signals: Signals) -> None:
    signals.header, signals.step = Head._make(values[_HEAD]), values[STEP_PLACE]


def _take_measurement(values: Values, signals: Signals) -> None:
    _place(values, signals)
    signals.measurement, signals.status = _state_at(values, _FIRST), values[-1]


def _take_filtered_state(values: Values, signals: Signals) -> None:
    _take_measurement(values, signals)
    signals.filtered_pitch_rate = values[_FIRST + 9]
    states = _FIRST + 11
    end = states + values[states - 1]
    signals.filter_state = np.array(values[states:end], float)
    signals.estimate = np.array(values[end + 1 : -1]) if values[end] else signals.measurement


def _take_nominal(values: Values, signals: Signals) -> None:
    _place(values, signals)
    signals.reference, signals.reference_input = _state_at(values, _FIRST), np.array(values[_FIRST + 9 : _FIRST + 11])
    deviation = _FIRST + 11
    signals.deviation = _state_at(values, deviation)
    signals.nominal_input = np.array(values[deviation + 9 : deviation + 11])


def _take_command(values: Values, signals: Signals) -> None:
    _place(values, signals)
    signals.command = np.array(values[_FIRST : _FIRST + 2])


class _ActuatorTaker:
    """Reads actuators' messages; faults that are those of the message before are not read again."""

    def __init__(self) -> None:
        self._said: Values = ()
        self._acting: tuple[ActiveFault, ...] = ()

    def __call__(self, values: Values, signals: Signals) -> None:
        _place(values, signals)
        signals.actuator = np.array(values[_FIRST : _FIRST + 2])
        said = values[_FIRST + 2 :]
        if said != self._said:
            self._acting = tuple(_faults(iter(said)))
            self._said = said
        signals.active_faults = self._acting


def _faults(said: Iterator[Any]) -> Iterator[ActiveFault]:
    """Yield the faults that a message Actuator ends with.

    Raises:
        ParameterError: An unknown channel, type or parameter, or a value that is not admitted.
    """
    from hsv.faults.table import Fault  # of most nodes, none needs it

    def text() -> str:
        next(said)
        return str(next(said)[:-1].decode(errors="replace"))

    faults = []
    for _ in range(next(said)):
        channel, kind = text(), text()
        names = [text() for _ in range(next(said))]
        numbers = [next(said) for _ in range(next(said))]
        faults.append((channel, kind, names, numbers))
    since = [next(said) for _ in range(next(said))]
    for (channel, kind, names, numbers), first in zip(faults, since, strict=True):
        yield ActiveFault(Fault.of(channel, kind, dict(zip(names, numbers, strict=True))), first)


TAKE: dict[str, Callable[[], Callable[[Values, Signals], None]]] = {
    MEASUREMENT: lambda: _take_measurement,
    FILTERED_STATE: lambda: _take_filtered_state,
    NOMINAL: lambda: _take_nominal,
    COMMAND: lambda: _take_command,
    ACTUATOR: _ActuatorTaker,
}
"""By topic, what makes the function that writes a message into the signals."""


def _give_clock(signals: Signals) -> Values:
    return signals.header[:2]


def _give_measurement(signals: Signals) -> Values:
    return *signals.header, signals.step, *_state(signals.measurement), int(signals.status)


def _give_vehicle_state(signals: Signals) -> Values:
    return *signals.header, signals.step, *_state(signals.state), int(signals.status)


def _give_forces(signals: Signals) -> Values:
    return *signals.header, signals.step, *signals.forces, *signals.effector.tolist(), *signals.air.tolist()


def _give_filtered_state(signals: Signals) -> Values:
    states = signals.filter_state.tolist()
    estimate = () if signals.estimate is signals.measurement else signals.estimate.tolist()
    return (
        *signals.header,
        signals.step,
        *_state(signals.measurement),
        signals.filtered_pitch_rate,
        len(states),
        *states,
        len(estimate),
        *estimate,
        signals.status,
    )


def _give_nominal(signals: Signals) -> Values:
    gain = signals.gain.ravel().tolist()
    return (
        *signals.header,
        signals.step,
        *_state(signals.reference),
        *signals.reference_input.tolist(),
        *_state(signals.deviation),
        *signals.nominal_input.tolist(),
        len(gain),
        *gain,
        signals.gain_index,
        int(signals.nominal_status),
    )


def _give_command(signals: Signals) -> Values:
    return *signals.header, signals.step, *signals.command.tolist(), *signals.saturated.tolist()


def _give_tube_status(signals: Signals) -> Values:
    result: Any = signals.diagnostics
    error, centre, half_width = result.error.tolist(), result.tube_centre.tolist(), result.tube_half_width.tolist()
    tau = result.tau.tolist()
    return (
        *signals.header,
        signals.step,
        len(error),
        *error,
        len(centre),
        *centre,
        len(half_width),
        *half_width,
        result.level,
        result.inside,
        *result.u_nominal.tolist(),
        *result.u_feedback.tolist(),
        *signals.reference_input.tolist(),
        *result.u_unsaturated.tolist(),
        len(tau),
        *tau,
        int(result.status),
    )


class _ActuatorGiver:
    """Writes actuators' messages; faults that are those of the message before are not written again."""

    def __init__(self) -> None:
        self._acting: tuple[ActiveFault, ...] = ()
        self._said: Values = (0, 0)

    def __call__(self, signals: Signals) -> Values:
        if signals.active_faults != self._acting:
            self._acting = signals.active_faults
            self._said = tuple(_said_of(self._acting))
        return *signals.header, signals.step, *signals.actuator.tolist(), *self._said


def _said_of(acting: tuple[ActiveFault, ...]) -> Iterator[Any]:
    """Yield what a message Actuator says of the faults."""

    def text(words: str) -> Values:
        data = words.encode() + b"\0"
        return len(data), data

    yield len(acting)
    for fault, _ in acting:
        yield from text(fault.channel)
        yield from text(fault.type)
        yield len(fault.parameters)
        for name in fault.parameters:
            yield from text(name)
        yield len(fault.parameters)
        yield from fault.parameters.values()
    yield len(acting)
    for _, since in acting:
        yield since


_GIVE: dict[str, Callable[[], Callable[[Signals], Values]]] = {
    CLOCK: lambda: _give_clock,
    MEASUREMENT: lambda: _give_measurement,
    STATE: lambda: _give_vehicle_state,
    FORCES: lambda: _give_forces,
    FILTERED_STATE: lambda: _give_filtered_state,
    NOMINAL: lambda: _give_nominal,
    COMMAND: lambda: _give_command,
    TUBE_STATUS: lambda: _give_tube_status,
    ACTUATOR: _ActuatorGiver,
}


def giver(topic: str) -> Callable[[Signals], bytes]:
    """Return the function that makes the bytes of a step topic's message of the signals; their header is a Head."""
    give, pack = _GIVE[topic](), codec(TOPICS[topic]).pack
    return lambda signals: pack(give(signals))

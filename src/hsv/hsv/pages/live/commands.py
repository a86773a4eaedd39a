"""Commands from the live page to the nodes of a flight, and the validation of requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hsv.bags.description import FAULT_INJECTOR, NodeDescription
from hsv.base.errors import ParameterError, one_of
from hsv.base.parameters import Parameter, read_number
from hsv.graph.node_parameters import SETTABLE, parse
from hsv.model.faults.injector import DURATION
from hsv.model.faults.table import CHANNELS, FAULT_KINDS, Fault, read_fault


@dataclass(frozen=True)
class Inject:
    """Command to inject a fault for a duration (simulated s); 0: until it is cleared."""

    fault: Fault
    duration: float
    node: NodeDescription = FAULT_INJECTOR


@dataclass(frozen=True)
class Clear:
    """Command to clear the faults of a channel and a type; an empty text means any."""

    channel: str
    type: str
    node: NodeDescription = FAULT_INJECTOR


@dataclass(frozen=True)
class Change:
    """Command to change a parameter in flight."""

    node: NodeDescription
    parameter: Parameter
    value: bool | float | list[float]


Command = Inject | Clear | Change


def read_command(fields: Mapping[str, Any]) -> Command:
    """Return the command in the ``fields`` of a request; quantities are texts with units.

    Raises:
        ParameterError, QuantityError: A field is missing, unknown or wrong.
    """
    name = _text(fields, "command")
    if name not in _COMMANDS:
        raise ParameterError(f"command = {name!r}: expected {one_of(_COMMANDS, name)}")
    reads, allowed = _COMMANDS[name]
    for field in fields:
        if field not in (*allowed, *_OF_EVERY_REQUEST):
            raise ParameterError(f"{field}: unknown field, expected {one_of(allowed, field)}")
    return reads(fields)


def _inject(fields: Mapping[str, Any]) -> Command:
    channel, kind = _choice(fields, "channel", CHANNELS), _choice(fields, "type", FAULT_KINDS)
    words = filter(str.strip, _text(fields, "parameters", "").split(","))
    parameters = ["=".join(map(str.strip, word.split("=", 1))) for word in words]
    duration = read_number(DURATION, _text(fields, "duration", "") or "0 s", "duration")
    return Inject(read_fault(channel, kind, parameters), duration)


def _clear(fields: Mapping[str, Any]) -> Command:
    channel, kind = _text(fields, "channel", ""), _text(fields, "type", "")
    return Clear(channel and _choice(fields, "channel", CHANNELS), kind and _choice(fields, "type", FAULT_KINDS))


def _change(name: str, field: str) -> Callable[[Mapping[str, Any]], Command]:
    node, parameter = SETTABLE[name]
    return lambda fields: Change(node, parameter, parse(_text(fields, field), parameter))


_COMMANDS: dict[str, tuple[Callable[[Mapping[str, Any]], Command], tuple[str, ...]]] = {
    "pause": (_change("paused", "paused"), ("paused",)),
    "pace": (_change("real_time_factor", "real_time_factor"), ("real_time_factor",)),
    "tau": (_change("feedback.tau", "tau"), ("tau",)),
    "inject": (_inject, ("channel", "type", "parameters", "duration")),
    "clear": (_clear, ("channel", "type")),
}
"""The reader of each command, and its fields"""

_OF_EVERY_REQUEST = ("command", "id", "token")


def _text(fields: Mapping[str, Any], name: str, default: str | None = None) -> str:
    value = fields.get(name, default)
    if not isinstance(value, str):
        raise ParameterError(f"{name} = {value!r}: expected a text" if name in fields else f"{name}: expected, missing")
    return value


def _choice(fields: Mapping[str, Any], name: str, known: Mapping[str, Any]) -> str:
    value = _text(fields, name)
    if value not in known:
        raise ParameterError(f"{name} = {value!r}: expected {one_of(known, value)}")
    return value

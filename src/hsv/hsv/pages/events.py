"""Events of a flight: faults, limited commands, times outside the tube, warnings, failures, changed parameters."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from markupsafe import Markup, escape

from hsv.bags.columns import expecting_fields
from hsv.bags.description import COMMAND, DIAGNOSTICS, PARAMETER_EVENTS, ROSOUT, STATE
from hsv.bags.info import intervals, parameters_in_words
from hsv.bags.reader import Bag
from hsv.model.signals import INPUT_NAMES
from hsv.pages.text import quantity

JOIN_WITHIN = 0.5
"""Longest time (s) between two events with the same text that are merged into one."""

DIAGNOSTICS_PERIOD = 1.0
"""Simulated time (s) between the diagnostics of a node."""

LOG_WARNING = 30
"""Level of a warning in rcl_interfaces/msg/Log; the levels of errors are higher."""

_FAILURES = {
    "diverged": "the flight diverged: the state left the range of the model",
    "broken off": "the recording breaks off: the run did not reach its end",
}

_DIAGNOSTIC_LEVELS = {1: "warning", 2: "error", 3: "error"}


@dataclass(frozen=True)
class Event:
    """An event; ``start`` and ``end`` (s) are equal for an instant, and ``end`` is None if the bag ends first."""

    start: float
    end: float | None
    kind: str
    """``fault``, ``saturation``, ``tube``, ``warning``, ``error`` or ``change``."""
    text: str
    subject: str = ""
    """The input or node concerned."""


def flight_events(bag: Bag, description: dict[str, Any]) -> list[Event]:
    """Return the events of a flight by start time; ``description`` is the result of :func:`hsv.bags.info.describe`."""
    tube = description["tube"] or {"excursions": ()}
    outside = [Event(e["start_s"], e["end_s"], "tube", "error outside the invariant set") for e in tube["excursions"]]
    events = [*_faults(description), *_joined(outside), *_saturation(bag)]
    # The first two hold for vehicle and hardware during the whole flight: one event at the start.
    for steps, text in (
        ("uncertified_steps", "vehicle outside the set that the tube is certified for"),
        ("uncertified_hardware_steps", "hardware or air that the tube is not certified for"),
        (
            "uncertified_rate_steps",
            "in some steps, altitude or velocity change faster than the bounds are certified for",
        ),
        ("uncertified_disturbance_steps", "in some steps, the measured disturbance is outside W"),
    ):
        if tube.get(steps):
            events.append(_instant(description["start_s"], "warning", text, "tube_mpc"))
    if failure := _FAILURES.get(description["ending"]):
        last = float(bag.columns(STATE)["header.stamp"][-1]) * 1e-9
        events.append(_instant(last, "error", failure, "plant"))
    with expecting_fields(bag.path):
        # Nodes report some things both in the log and in their diagnostics.
        reported = sorted([*_diagnostics(bag), *_log(bag)], key=lambda event: event.start)
        events += [*_joined(reported, within=1.5 * DIAGNOSTICS_PERIOD), *_parameter_changes(bag)]
    return sorted(events, key=lambda event: event.start)


def _instant(time: float, kind: str, text: str, subject: str) -> Event:
    return Event(time, time, kind, text, subject)


def _messages(bag: Bag, topic: str) -> Iterator[tuple[float, Any]]:
    """Yield time (s) and decoded message for every message of a topic; nothing if the bag lacks the topic."""
    for time, message in bag.decode(topic) if topic in bag.roles else ():
        yield time * 1e-9, message


def _faults(description: dict[str, Any]) -> Iterator[Event]:
    for fault in description["faults"] or ():
        channel, kind = (escape(fault[key].replace("_", " ")) for key in ("channel", "type"))
        # Names in an external bag are escaped; quantities are HTML in all systems of units.
        named = {str(escape(name)): value for name, value in fault["parameters"].items()}
        parameters = parameters_in_words({**fault, "parameters": named}, quantity)
        text = Markup(f"{channel}: {kind} {parameters}".rstrip())
        yield Event(fault["start_s"], fault["end_s"], "fault", text, fault["channel"])


def _saturation(bag: Bag) -> Iterator[Event]:
    if COMMAND not in bag.roles:
        return
    columns = bag.columns(COMMAND)
    for column, name in enumerate(INPUT_NAMES):
        text = f"command of {name.replace('_', ' ')} limited"
        limited = intervals(columns["header.stamp"], columns["saturated"][:, column])
        yield from _joined(Event(each["start_s"], each["end_s"], "saturation", text, name) for each in limited)


def _diagnostics(bag: Bag) -> Iterator[Event]:
    for time, message in _messages(bag, DIAGNOSTICS):
        for status in message.status:
            if kind := _DIAGNOSTIC_LEVELS.get(status.level):
                node = status.name.partition(": ")[0]  # "node: task"
                yield _instant(time, kind, f"{node}: {status.message}", node)


def _log(bag: Bag) -> Iterator[Event]:
    """Yield the warnings and errors in the log of this graph; other graphs in the domain log to the same topic."""
    for time, message in _messages(bag, ROSOUT):
        # The name of a logger is that of its node, with dots instead of slashes.
        space, _, node = message.name.rpartition(".")
        if message.level >= LOG_WARNING and space == bag.namespace.strip("/").replace("/", "."):
            kind = "warning" if message.level == LOG_WARNING else "error"
            yield _instant(time, kind, f"{node}: {message.msg}", node)


def _parameter_changes(bag: Bag) -> Iterator[Event]:
    for time, message in _messages(bag, PARAMETER_EVENTS):
        names = ", ".join(parameter.name for parameter in message.changed_parameters)
        space, _, _ = message.node.rpartition("/")
        if names and time > 0.0 and space == bag.namespace.rstrip("/"):
            yield _instant(time, "change", f"{message.node}: {names} changed", message.node)


def _joined(events: Iterable[Event], within: float = JOIN_WITHIN) -> list[Event]:
    """Return chronological ``events``, merging those of the same text that are at most ``within`` seconds apart."""
    last: dict[str, int] = {}
    joined: list[Event] = []
    for event in events:
        index = last.get(event.text)
        if index is not None and (end := joined[index].end) is not None and event.start - end <= within:
            joined[index] = replace(joined[index], end=event.end)
            continue
        last[event.text] = len(joined)
        joined.append(event)
    return joined

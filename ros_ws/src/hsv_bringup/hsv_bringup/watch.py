"""Show the current state of a running flight on one line."""

from __future__ import annotations

import sys
import time
from math import isfinite
from types import SimpleNamespace
from typing import Any

from hsv.bags.description import ACTUATOR, NOMINAL, STATE, TOPICS, TUBE_STATUS
from hsv.base.errors import RunError
from hsv.base.units import UnitSystem, in_system, significant
from hsv_bringup.client import GraphClient, answer
from hsv_node.middleware import LATEST, message_class

EVERY = 0.2
"""Wall time (s) between two updates."""

_CLEARED = "\r\x1b[K"
"""Control sequence that returns to the start of the line and clears it."""


def watch_flight(client: GraphClient, options: SimpleNamespace) -> None:
    """Print the state of the flight until it ends: on one updated line in a terminal, otherwise a line per update."""
    system = UnitSystem(options.units)
    latest: dict[str, Any] = {}
    for topic in (STATE, NOMINAL, TUBE_STATUS, ACTUATOR):

        def keep(message: Any, topic: str = topic) -> None:
            latest[topic] = message

        client.create_subscription(message_class(TOPICS[topic]), topic, keep, LATEST)
    state = client.resolve_topic_name(STATE)
    if not client.wait_for(lambda: {STATE, NOMINAL, ACTUATOR} <= latest.keys(), f"a step on {state}", (STATE,)):
        if client.count_publishers(state):
            raise RunError(f"no step on {state}: expected a run that is not paused (hsv set paused false)")
        raise RunError(f"no run in {client.where}: expected hsv run, or nodes started by hand there")
    print(f"flight in {client.where}", file=sys.stderr, flush=True)
    moves = sys.stdout.isatty() and not options.json
    shown = 0.0

    def came() -> bool:
        return STATE in latest or not client.count_publishers(state)

    while client.wait_for(came, f"a step on {state}", for_ever=True) and STATE in latest:
        reached = latest.pop(STATE)
        if time.monotonic() - shown < EVERY and reached.status == reached.RUNNING:
            continue
        shown = time.monotonic()
        values = _snapshot(reached, latest[NOMINAL], latest.get(TUBE_STATUS), latest[ACTUATOR])
        words = _values_text(values, system)
        if moves:
            print(_CLEARED + words, end="", flush=True)
        else:
            answer(words, values, options.json)
    if moves:
        print()


def _snapshot(state: Any, nominal: Any, status: Any | None, actuator: Any) -> dict[str, Any]:
    """Return the values to display (SI), from the latest messages; the tube level is None without a tube."""
    return {
        "time": state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec,
        "altitude": state.altitude,
        "velocity_error": state.velocity - nominal.reference.velocity,
        "tube_level": None if status is None or not isfinite(status.level) else float(status.level),
        "faults": [f"{fault.channel} {fault.type}" for fault in actuator.active],
    }


def _values_text(values: dict[str, Any], system: UnitSystem) -> str:
    """Return the values of a snapshot as text with columns of fixed width; the active faults come last."""
    altitude, length = in_system(values["altitude"], "m", system)
    error, speed = in_system(values["velocity_error"], "m/s", system)
    level = "-" if values["tube_level"] is None else significant(values["tube_level"])
    faults = ", ".join(values["faults"]).replace("_", " ") or "no fault"
    time = f"t {values['time']:6.1f} s"
    return f"{time}  h {altitude:7.0f} {length}  V off {error:+7.2f} {speed}  tube {level:>7}  {faults}"

"""Check that a controller gives the same bits in every flight, alone and together with other flights.

Repeated runs, campaigns in many processes and replays from the middle of a run require that the memory of a controller
belongs to the instance, is cleared by ``reset`` and can be copied.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np

from hsv.base.errors import HsvError, RunError
from hsv.control.controller import ControllerInput
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.executors import make_executor
from hsv.flight.closed_loop import Components, fly
from hsv.flight.flight import Flight
from hsv.flight.history import SIGNALS, History
from hsv.flight.scenario import Scenario, load_scenario, scenario_names
from hsv.model.signals import PITCH_RATE

FLOWN_BY_DEFAULT = "case1"
"""Scenario that is flown if only a controller is given."""

_FLIGHTS = 2
"""Simultaneous flights in each process of the check under load."""


@dataclass(frozen=True)
class Finding:
    """The result of a check: its name, its number of flights, and the first difference or failure in words, if any."""

    check: str
    flights: int
    difference: str
    not_checked: str = ""
    """Why the check could not be made"""


def scenario_of(name: str) -> Scenario:
    """Return the scenario ``name`` (or path), or the default scenario with the controller ``name``."""
    if name in scenario_names() or name.endswith(".toml"):
        return load_scenario(name)
    return load_scenario(FLOWN_BY_DEFAULT, {"controller": name})


def findings(scenario: Scenario) -> Iterator[Finding]:
    """Fly ``scenario`` twice, after a reset, from a copied state and under load; yield a finding for each.

    Raises:
        ScenarioError, ParameterError: The scenario cannot be flown, or not in one process.
        RunError: The controller failed in the first flight.
    """
    parts = assemble_flight(scenario)
    first = fly(parts)
    yield Finding("flown twice", 2, _flown_alike(first, assemble_flight(scenario)))
    yield Finding("after a reset", 2, _flown_alike(first, parts))
    parts = assemble_flight(scenario)
    if why := parts.controller.not_copied:
        yield Finding("from a copied state", 0, "", why)
    else:
        yield Finding("from a copied state", 2, from_copied_state(parts, first))
    yield under_load(scenario, first)


def from_copied_state(parts: Components, flight: Flight) -> str:
    """Step the controller along a ``flight`` again and, from the middle of the flight on, a copy of the controller too.

    Return in words the first step whose unsaturated input differs from the flight's, or a failure; empty: neither.
    """
    h, steps = flight.history, len(flight.time)
    steppers = {"the controller": parts.controller}
    try:
        parts.controller.reset()
        parts.notch_filter.reset()
        for k in range(steps):
            if k == steps // 2:
                try:
                    steppers["its copy"] = parts.controller.copied()
                # Copying an object of foreign code may raise any exception.
                except Exception as error:
                    return f"the controller cannot be copied: {type(error).__name__}: {' '.join(str(error).split())}"
            filtered = parts.notch_filter.step(h.estimate[k, PITCH_RATE])
            for name, stepper in steppers.items():
                rows = h.estimate, flight.reference, flight.reference_input, h.deviation, h.nominal_input
                # Copied, because a controller may keep or change its inputs.
                x, x_r, u_r, x_n, u_n = (row[k].copy() for row in rows)
                states = filtered.filter_state.copy()
                inputs = ControllerInput(k, x, filtered.filtered_pitch_rate, x_r, u_r, x_n, u_n, states)
                answered, expected = stepper.step(inputs).u_unsaturated, h.u_unsaturated[k]
                if answered.tobytes() != expected.tobytes():
                    return f"{name}: u_unsaturated from step {k} on: {answered.tolist()}, not {expected.tolist()}"
    except HsvError as error:
        return str(error)
    return ""


def under_load(scenario: Scenario, first: Flight) -> Finding:
    """Fly ``scenario`` in two to five processes, several flights at a time in each; compare them with ``first``."""
    processes = min(os.cpu_count() or 1, 4) + 1
    name, histories = f"under load, {processes} processes", list[History]()
    try:
        with make_executor(processes) as executor:
            for _, flown in executor.fly(partial(_fly_at_once, scenario), "", range(processes)):
                histories += pickle.loads(flown)
    except HsvError as error:
        return Finding(name, processes * _FLIGHTS, "a process died" if isinstance(error, RunError) else str(error))
    differences = (_difference(first.history, history) for history in histories)
    return Finding(name, len(histories), next(filter(None, differences), ""))


def _fly_at_once(scenario: Scenario, text: str, number: int) -> bytes:
    with ThreadPoolExecutor(_FLIGHTS) as threads:
        return pickle.dumps(list(threads.map(lambda _: fly(assemble_flight(scenario)).history, range(_FLIGHTS))))


def _flown_alike(first: Flight, parts: Components) -> str:
    try:
        return _difference(first.history, fly(parts).history)
    except RunError as error:
        return str(error)


def _difference(first: History, other: History) -> str:
    """Return in words where the bytes of the ``other`` history first differ from ``first``, or empty text."""
    rows = min(len(first.state), len(other.state))
    found = []
    # In the order of the loop, because the first signal that differs within a step is the cause.
    for order, name in enumerate(SIGNALS):
        columns = (getattr(history, name)[:rows] for history in (first, other))
        expected, flown = (np.ascontiguousarray(column).reshape(rows, -1) for column in columns)
        different = np.flatnonzero(np.any(expected.view(np.uint64) != flown.view(np.uint64), axis=1))
        if len(different):
            step = int(different[0])
            found.append(
                (step, order, f"{name} from step {step} on: {flown[step].tolist()}, not {expected[step].tolist()}")
            )
    if found:
        return min(found)[2]
    if len(first.state) != len(other.state):
        return f"ends with step {len(other.state) - 1}, not {len(first.state) - 1}"
    return ""

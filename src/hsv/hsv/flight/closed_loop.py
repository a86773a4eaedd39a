"""The closed loop in one process: the core flies it with the arithmetic and the order of the graph of nodes."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate, pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from hsv import core
from hsv.base.errors import ControllerError, ProcessError
from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput
from hsv.control.nominal_law import NominalLaw
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import NotchFilter
from hsv.control.tube_law import no_tube
from hsv.core import Callback, Struct, ffi
from hsv.flight.flight import Flight, flight_of
from hsv.flight.history import History
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.table import COMMAND
from hsv.model.plant import Plant, PlantFaults
from hsv.model.signals import N_INPUTS, N_STATES, VARYING


@dataclass
class Components:
    """The components of the loop by the names of their blocks, see :mod:`hsv.flight.blocks`."""

    plant: Plant
    notch_filter: NotchFilter
    nominal_trajectory: NominalTrajectory
    controller: Controller
    fault_injector: FaultInjector

    def perturbed(self, perturbation: Mapping[str, float]) -> Components:
        """Return the loop around the perturbed vehicle, relative changes by parameter name; the rest is shared."""
        return replace(self, plant=self.plant.perturbed(perturbation))


def fly(components: Components) -> Flight:
    """Fly ``components`` from the plant's initial trim to the end of its duration, or until it diverges.

    The core calls a nominal law that solves a problem in flight and a custom controller in Python. Flights with such a
    block wait for one another: it has one state. With a controller in a shared library the loop flies in a child
    process, and flights wait for one another, too.

    Raises:
        ControllerError: A custom controller failed; it is named, with the step.
        ParameterError: The controller is a node of its own.
    """
    rows = components.plant.steps + 1
    if components.controller.library is not None:
        with watched(components.controller, rows) as (history, request):
            flown = request("fly", rows, kept=vars(components))
            return flight_of(components, history.copy().cut(flown))
    history = History.empty(rows, estimated=not is_ideal(components))
    return flight_of(components, history.cut(fly_into(history, components)))


def is_ideal(components: Components) -> bool:
    """Return whether equipment, links and air are ideal, and the controller receives the state itself."""
    injector = components.fault_injector
    ideal = components.plant.is_ideal(injector.known) and injector.link.ideal
    return ideal and components.notch_filter.estimator is None


@contextmanager
def watched(controller: Controller, rows: int) -> Iterator[tuple[History, Callable[..., Any]]]:
    """Yield the history, of so many steps, that a library's flights are written to, and what requests them.

    Flights are given up when they stand still; an error says in which step.
    """
    library = controller.library
    with library.sharing(rows * History.numbers()) as memory:
        history = History.over(memory, rows)

        def begun() -> int:
            # The pitch rate of a step is written before the controller is called.
            return int(np.count_nonzero(~np.isnan(history.filtered_pitch_rate)))

        history.filtered_pitch_rate[:] = np.nan
        try:
            yield history, partial(library.request, begun=begun)
        except ProcessError as error:
            where = f", step {begun() - 1}" if begun() else ""
            raise ControllerError(f"{controller.name}{where}: {error}") from error


_ONE_AT_A_TIME = threading.Lock()


def fly_into(history: History, components: Components) -> int:
    """Fly ``components`` in this process, as many steps as ``history`` has rows; return how many were flown.

    Raises:
        ControllerError, ParameterError: As :func:`fly`.
    """
    law, controller = components.nominal_trajectory.law, components.controller
    callbacks, calls = [], {}
    if not law.in_core:
        callbacks.append(_solving(law))
        calls["nominal_law"] = callbacks[-1].call
    if not controller.in_core:
        if controller.kernel is None:
            callbacks.append(_controlling(controller, 2 * len(components.notch_filter.data.D)))
            calls["controller"] = callbacks[-1].call
        else:
            address, state, parameters = controller.kernel
            calls["controller"] = SimpleNamespace(function=address, state=state.copy(), par=parameters)
    flight = flight_struct(components, history, **calls)
    with _ONE_AT_A_TIME if callbacks else nullcontext():
        if callbacks:
            law.reset()
            controller.reset()
        rows = core.fly([flight], core.loop_memory(1), 0, len(history.flown))
    for callback in callbacks:
        if callback.error is not None:
            raise callback.error
    if rows < 0:
        if code := flight.pointer.returned:
            raise ControllerError(f"{controller.name}, step {-1 - rows}: returned {code}, expected 0")
        raise controller.failure(-1 - rows, f"answered {list(flight.pointer.answer)}")
    return rows


NO_CALL = SimpleNamespace(function=None, state=None, par=None)
"""In place of a block from outside: the core's own law flies."""


def flight_struct(components: Components, history: History, **others: Any) -> Struct:
    """Return the flight of ``components`` as the core takes it, before its first step.

    Args:
        components: The components, none of which is changed.
        history: Written in flight.
        others: Calls of a nominal law or a controller from outside, and the invariant set whose level is computed.
    """
    plant, notch, injector = components.plant, components.notch_filter, components.fault_injector
    nominal, controller = components.nominal_trajectory, components.controller
    tube = controller.kernel if controller.in_core else no_tube(plant.vehicle)
    fields = {
        "x": plant.initial.state,
        "plant": plant.data.struct,
        "plant_memory": Struct("hsv_plant_memory", plant.memory()),
        "plant_faults": Struct("hsv_plant_faults", PlantFaults.of(injector.known, plant.period)),
        "notch": notch.data.struct,
        "estimator": notch.estimator.data.struct if notch.estimator else None,
        "nominal": nominal.data.struct,
        "reference": nominal.reference.data.struct,
        "tube": tube.struct,
        "link": injector.link.struct,
        "link_memory": injector.link_state(),
        "faults": Struct("hsv_faults", injector.rows((COMMAND,))),
        "nominal_law": NO_CALL,
        "controller": NO_CALL,
        "set": None,
        "history": history.flown,
        "auxiliary": history.beside,
        "estimated": history.estimated,
        "ended": len(history.flown),
        "returned": 0,
        "answer": [0.0] * N_INPUTS,
        "worst": -np.inf,
    }
    return Struct("hsv_flight", SimpleNamespace(**fields | others))


def _solving(law: NominalLaw) -> Callback:
    def solve(step: int, given: Any, out: Any) -> None:
        chosen = law.step(np.array(ffi.unpack(given, N_STATES)))
        out[0], out[1] = chosen.input
        out[2] = chosen.gain_index

    return Callback(solve)


def _controlling(controller: Controller, filter_states: int) -> Callback:
    ends = [*accumulate(filter_states if signal.size == VARYING else signal.size for signal in CONTROLLER_INPUTS)]
    cuts = [slice(*cut) for cut in pairwise((0, *ends))]

    def control(step: int, given: Any, out: Any) -> None:
        # A copy: a controller may keep its inputs.
        now = np.array(ffi.unpack(given, ends[-1]))
        estimate, filtered_pitch_rate, *others = [now[cut] for cut in cuts]
        inputs = ControllerInput(step, estimate, float(filtered_pitch_rate[0]), *others)
        out[0], out[1] = controller.unsaturated_input(inputs)

    return Callback(control)

"""The closed loop in one process: the core simulates it with the arithmetic and the order of the node graph."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from hsv import core
from hsv.base.errors import ControllerError, ProcessError
from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput, guarded, overwritten
from hsv.control.nominal_law import FamilyLaw
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import NotchFilter
from hsv.control.tube_law import no_tube
from hsv.core import Callback, Struct, ffi
from hsv.flight.flight import Flight, flight_of
from hsv.flight.history import History
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.table import COMMAND
from hsv.model.plant import Plant, plant_faults
from hsv.model.signals import N_INPUTS, N_STATES, VARYING
from hsv.plugins.library import LibraryController


@dataclass
class Components:
    """The five components of the closed loop, named like their blocks in :mod:`hsv.flight.blocks`."""

    plant: Plant
    notch_filter: NotchFilter
    nominal_trajectory: NominalTrajectory
    controller: Controller
    fault_injector: FaultInjector

    def perturbed(self, perturbation: Mapping[str, float]) -> Components:
        """Return the loop with relative changes of vehicle parameters, by name; all other components are shared."""
        return replace(self, plant=self.plant.perturbed(perturbation))


def fly(components: Components) -> Flight:
    """Return the flight of ``components`` from the plant's initial trim to the end of its duration, or to divergence.

    The core calls back into Python for a nominal law that optimises in flight and for a custom Python controller.
    Flights with such a block run one at a time, because the block has a single state. With a controller in a shared
    library the loop runs in a child process, one flight at a time.

    Raises:
        ControllerError: A custom controller failed; the message names it and, if known, the step.
        ParameterError: The controller is a separate node.
    """
    rows = components.plant.steps + 1
    if components.controller.library is not None:
        with watched(components.controller, rows) as (history, request):
            steps = request("call", int, _fly_in_child, rows, kept=vars(components))
            if not 1 <= steps <= rows:
                raise ProcessError("wrote an answer of its own")
            return flight_of(components, history.copy().cut(steps))
    history = History.empty(rows, estimated=not is_ideal(components))
    steps, law_times = fly_into(history, components)
    return replace(flight_of(components, history.cut(steps)), law_times=law_times)


def is_ideal(components: Components) -> bool:
    """Return whether equipment, links and air are ideal, all faults are of the command, and no estimator is enabled.

    The controller then receives the true state, and its commands are not late.
    """
    injector = components.fault_injector
    ideal = components.plant.is_ideal(injector.known) and injector.link.ideal
    return ideal and components.notch_filter.estimator is None


def _fly_in_child(rows: int, **parts: Any) -> int:
    """Simulate a flight of at most ``rows`` steps into the memory shared with the parent; return its steps."""
    components = Components(**parts)
    controller = components.controller
    assert isinstance(controller, LibraryController)
    components.controller = controller.loaded(controller.library.describe(controller.symbol).address)
    with controller.library.sharing(rows * History.numbers()) as memory:
        return fly_into(History.over(memory, rows), components)[0]


@contextmanager
def watched(controller: Controller, rows: int) -> Iterator[tuple[History, Callable[..., Any]]]:
    """Yield a history of ``rows`` steps in shared memory, and a function that sends requests to the child process.

    The child process has the shared library of the ``controller``, and writes its flights to the history.

    Raises:
        ControllerError: The child process crashed or made no progress; the message names the step, if one has begun.
    """
    library = controller.library
    with library.sharing(rows * History.numbers()) as memory:
        history = History.over(memory, rows)

        def begun() -> int:
            # The core writes the filtered pitch rate of a step before it calls the controller.
            return int(np.count_nonzero(~np.isnan(history.filtered_pitch_rate)))

        history.filtered_pitch_rate[:] = np.nan
        try:
            yield history, partial(library.request, begun=begun)
        except ProcessError as error:
            where = f", step {begun() - 1}" if begun() else ""
            raise ControllerError(f"{controller.name}{where}: {error}") from error


_ONE_AT_A_TIME = threading.Lock()


def fly_into(history: History, components: Components) -> tuple[int, dict[str, Sequence[float]]]:
    """Simulate ``components`` in this process into ``history``; return the number of steps and ``Flight.law_times``."""
    law, controller = components.nominal_trajectory.law, components.controller
    callbacks = {}
    if not law.in_core:
        callbacks["nominal_law"] = _law_callback(law)
    if not controller.in_core and controller.kernel is None:
        callbacks["controller"] = _controller_callback(controller, 2 * len(components.notch_filter.data.D))
    calls, own = {name: callback.call for name, callback in callbacks.items()}, None
    if not controller.in_core and controller.kernel is not None:
        address, state, parameters = controller.kernel
        own = guarded(state)
        calls["controller"] = Struct("hsv_call", function=address, state=own, par=parameters)
    flight = flight_struct(components, history, **calls)
    with _ONE_AT_A_TIME if callbacks else nullcontext():
        if callbacks:
            law.reset()
            controller.reset()
        rows = core.fly([flight], core.loop_memory(1), 0, len(history.signals))
    for callback in callbacks.values():
        if callback.error is not None:
            raise callback.error
    if own is not None and (wrong := overwritten(flight.pointer.returned, own)):
        raise ControllerError(f"{controller.name}: {wrong}")
    if rows < 0:
        if code := flight.pointer.returned:
            raise ControllerError(f"{controller.name}, step {-1 - rows}: returned {code}, expected 0")
        raise controller.failure(-1 - rows, f"answered {list(flight.pointer.answer)}")
    nodes = {"nominal_law": "nominal_trajectory", "controller": "controller"}
    return rows, {nodes[name]: callback.times for name, callback in callbacks.items()}


NO_CALL = Struct("hsv_call", function=None, state=None, par=None)
"""An empty call: there is no external block, and the core uses its own law."""


def flight_struct(components: Components, history: History, **others: Any) -> Struct:
    """Return the core's struct of a flight before its first step; the core writes the flight to ``history``.

    ``others`` replace fields of the struct: ``nominal_law`` and ``controller`` call external laws; ``commanded``, shape
    (2,), is an external input before saturation; ``set`` is the invariant set in which the error's level is computed.
    """
    plant, notch, injector = components.plant, components.notch_filter, components.fault_injector
    nominal, controller = components.nominal_trajectory, components.controller
    tube = controller.kernel if controller.in_core else no_tube(plant.vehicle)
    fields = {
        "x": plant.initial.state,
        "plant": plant.data,
        "plant_memory": plant.memory(),
        "plant_faults": plant_faults(injector.known, plant.period),
        "notch": notch.data,
        "estimator": notch.estimator.data if notch.estimator else None,
        "nominal": nominal.data,
        "reference": nominal.reference.data,
        "tube": tube,
        "link": injector.link,
        "link_memory": injector.link_state(),
        "faults": injector.rows((COMMAND,)),
        "nominal_law": NO_CALL,
        "controller": NO_CALL,
        "commanded": None,
        "set": None,
        "history": history.signals,
        "auxiliary": history.auxiliary,
        "estimated": history.estimated,
        "ended": len(history.signals),
        "returned": 0,
        "answer": [0.0] * N_INPUTS,
        "worst": -np.inf,
    }
    return Struct("hsv_flight", **fields | others)


def _law_callback(law: FamilyLaw) -> Callback:
    def solve(step: int, arguments: Any, out: Any) -> None:
        result = law.step(np.array(ffi.unpack(arguments, N_STATES)))
        out[0], out[1] = result.input
        out[2] = result.gain_index

    return Callback(solve)


def _controller_callback(controller: Controller, filter_states: int) -> Callback:
    ends = [*accumulate(filter_states if signal.size == VARYING else signal.size for signal in CONTROLLER_INPUTS)]
    cuts = [slice(*cut) for cut in pairwise((0, *ends))]

    def control(step: int, arguments: Any, out: Any) -> None:
        # Copy the inputs, because the controller may keep them.
        values = np.array(ffi.unpack(arguments, ends[-1]))
        feedback_state, filtered_pitch_rate, *others = [values[cut] for cut in cuts]
        inputs = ControllerInput(step, feedback_state, float(filtered_pitch_rate[0]), *others)
        out[0], out[1] = controller.unsaturated_input(inputs)

    return Callback(control)

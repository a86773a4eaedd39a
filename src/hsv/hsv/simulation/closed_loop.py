"""The closed loop in one process, compiled: the same arithmetic, in the same order, as the graph of nodes."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput
from hsv.control.estimator import estimate_step
from hsv.control.nominal_law import NominalData, NominalLaw, nominal_input
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_advance
from hsv.control.notch_filter import NotchData, NotchFilter, filter_step, rest
from hsv.control.tube_law import memory_of, no_tube, tube_step, watch_of
from hsv.errors import ControllerError, ProcessError
from hsv.faults.injector import FaultInjector
from hsv.faults.laws import START, FaultRows, apply_command_faults, fault_memory
from hsv.faults.table import COMMAND
from hsv.lanes import every, lane
from hsv.links import receive
from hsv.signals import VARYING
from hsv.simulation.flight import Flight, flight_of
from hsv.simulation.foreign import NO_CALL, NOTHING, Callback, call_of, call_step
from hsv.simulation.history import (
    ACTUATOR,
    GAIN_INDEX,
    Q_F,
    U_N,
    U_UNSATURATED,
    X_N,
    History,
    U,
    X,
)
from hsv.timing import NEVER
from hsv.vehicle.dynamics import N_INPUTS, N_STATES, PITCH_RATE
from hsv.vehicle.envelope import in_model_range
from hsv.vehicle.integration import advance
from hsv.vehicle.plant import Plant, PlantFaults, advance_plant, sense


@dataclass
class Components:
    """The components of the loop by the names of their blocks, see :mod:`hsv.simulation.blocks`."""

    plant: Plant
    notch_filter: NotchFilter
    nominal_trajectory: NominalTrajectory
    controller: Controller
    fault_injector: FaultInjector

    def perturbed(self, perturbation: Mapping[str, float]) -> Components:
        """Return the loop around the perturbed vehicle, relative changes by parameter name; the rest is shared."""
        return replace(self, plant=self.plant.perturbed(perturbation))


class LoopArrays(NamedTuple):
    """The signals of a step between nominal trajectory and actuators, and the memories of the tube law, in place.

    What a controller is given is one array.
    """

    estimate: np.ndarray
    filtered_pitch_rate: np.ndarray
    reference: np.ndarray
    reference_input: np.ndarray
    deviation: np.ndarray
    nominal_input: np.ndarray
    filter_state: np.ndarray
    wanted: np.ndarray
    returned: np.ndarray
    """(1) what the function of a compiled controller returned"""
    gain_index: np.ndarray
    memory: np.ndarray
    watch: np.ndarray


class Workspace(NamedTuple):
    """Arrays that the compiled loop writes to beside."""

    measurement: np.ndarray
    filter_state: np.ndarray
    defect: np.ndarray
    weights: np.ndarray
    schedule: np.ndarray
    advanced: np.ndarray
    feedback: np.ndarray
    total: np.ndarray
    command: np.ndarray
    actuator: np.ndarray
    estimator_state: np.ndarray
    estimator: np.ndarray

    @classmethod
    def of(cls, zeros: Callable[..., Any], notch: NotchData, nominal: NominalData) -> Workspace:
        """Return those of a flight with this filter and nominal system, made by ``zeros``, which takes a shape."""
        n, m = N_STATES, N_INPUTS
        vertices, entries = nominal.polytope.S.shape
        sizes = (n, 2 * len(notch.D), n, vertices, entries, n, m, m, m, m, n + m)
        return cls._make([*map(zeros, sizes), zeros((4, n))])


class CommandFaults(NamedTuple):
    """Faults on the command of a flight, what they remember, and the seed of the flight."""

    rows: FaultRows
    memory: np.ndarray
    seed: int

    @classmethod
    def of(cls, components: Components) -> CommandFaults:
        """Return those of a flight, before they act."""
        rows = components.fault_injector.rows((COMMAND,))
        return cls(rows, fault_memory(rows), components.plant.data.seed)

    @property
    def first(self) -> int:
        """The step in which the first may act."""
        return int(self.rows.table[:, START].min()) if len(self.rows.table) else NEVER


_ONE_AT_A_TIME = threading.Lock()


def _loop_arrays(
    filter_states: int, memory: np.ndarray, watch: np.ndarray
) -> tuple[np.ndarray, list[slice], LoopArrays]:
    """Return what a controller is given, where each signal lies in it, and the arrays of which they are views."""
    ends = [*accumulate(filter_states if signal.size == VARYING else signal.size for signal in CONTROLLER_INPUTS)]
    given = np.zeros(ends[-1])
    cuts = [slice(*cut) for cut in pairwise((0, *ends))]
    views = [given[cut] for cut in cuts]
    return given, cuts, LoopArrays._make((*views, np.zeros(N_INPUTS), np.zeros(1), np.zeros(1), memory, watch))


@njit_in_flight(nogil=True)
def fly_loop(
    x: Any,
    plant: Any,
    plant_memory: Any,
    plant_faults: Any,
    estimator: Any,
    notch: Any,
    nominal: Any,
    nominal_call: Any,
    tube: Any,
    controller_call: Any,
    link: Any,
    link_state: Any,
    faults: Any,
    first_fault: int,
    reference: Any,
    arrays: Any,
    work: Any,
    history: Any,
    ended: np.ndarray,
    start: int,
    stop: int,
) -> int:
    """Fly the steps ``start`` ... ``stop`` - 1, the first from state ``x`` (9); return the one after the last flown.

    Before ``stop``: all flights have diverged. Below zero, -1 - k: a block that was called failed in step k. Without
    ``plant_faults`` the plant is ideal, and so is the ``link`` of the command, without ``estimator`` there is none;
    other functions are compiled for these, as what is not used would take a tenth of the time. Of lanes each is a
    flight, whose rows are written to ``ended`` (lanes), which holds those of a flight that does not diverge.

    A flight may be flown in pieces: from where the piece before stopped, with the same arguments as they were left.

    Args:
        faults: :class:`CommandFaults` of each lane.
        first_fault: Step before which the command arrives as it is: what a call takes is a twentieth of the loop's
            time.
        history: Its first row is of the step ``start``.
    """
    estimate, q_f, x_r, u_r, x_n, u_n, s, wanted, returned, gain_index, memory, watch = arrays
    n, m = len(x), len(u_n)
    measurement, filter_state, defect, weights, S, new, u_feedback, total, u, actuator, x_e, estimator_work = work
    vehicle, period, substeps = plant.vehicle, plant.period, plant.substeps
    lowest, highest = plant.actuators.minimum, plant.actuators.maximum
    effector, integration = plant_memory.effector, plant_memory.work
    last = len(reference.state) - 1
    planned = len(nominal.gains) > 0
    if start == 0:
        if plant_faults is None:
            for i in range(n):
                measurement[i] = x[i]
        else:
            sense(x, plant, plant_memory, plant_faults, 0, measurement)
        rest(notch, measurement[PITCH_RATE], filter_state)
        for i in range(n):
            x_n[i] = measurement[i] - reference.state[min(max(-reference.first, 0), last), i] if planned else 0.0
    # Copied when another row holds: views of rows in every step take a twentieth of the loop's time.
    row = -1
    flown, beside, estimated = history
    for k in range(start, stop):
        line = k - start
        if k > 0:
            if plant_faults is None:
                for i in range(m):
                    effector[i] = min(max(actuator[i], lowest[i]), highest[i])
                advance(x, effector, vehicle, period, substeps, integration)
                for i in range(n):
                    measurement[i] = x[i]
            else:
                advance_plant(x, actuator, plant, plant_memory, plant_faults, k - 1)
                sense(x, plant, plant_memory, plant_faults, k, measurement)
        for i in range(n):
            flown[line, X + i] = x[i]
            estimate[i] = measurement[i]
        if estimator is not None:
            estimate_step(estimator, x_e, k, measurement, u, estimator_work, estimate)
            if k == 0:
                rest(notch, estimate[PITCH_RATE], filter_state)
        if plant_faults is not None:
            for i in range(n):
                estimated[line, i] = estimate[i]
        due = min(max(k - reference.first, 0), last)
        if due != row:
            row = due
            for i in range(n):
                x_r[i] = reference.state[row, i]
                defect[i] = reference.defect[row, i]
            for i in range(m):
                u_r[i] = reference.input[row, i]
        for i in range(len(s)):
            s[i] = filter_state[i]
        q_f[0] = filter_step(notch, filter_state, estimate[PITCH_RATE])
        flown[line, Q_F] = q_f[0]
        for i in range(n):
            flown[line, X_N + i] = x_n[i]
        called = False
        if nominal_call is not None:
            called = nominal_call.function != NOTHING
            if called and call_step(nominal_call.function, k, 0, 0, 0, 0) != 0:
                return -1 - k
        if planned and not called:
            gain_index[0], _ = nominal_input(nominal, x_n, u_n)
        beside[line, GAIN_INDEX] = gain_index[0]
        for i in range(m):
            flown[line, U_N + i] = u_n[i]
        called = False
        if controller_call is not None:
            function, inputs, outputs, state, parameters = controller_call
            called = function != NOTHING
            if called:
                for i in range(m):
                    wanted[i] = math.nan  # what is not answered is no answer, not the one before
                returned[0] = call_step(function, k, inputs, outputs, state, parameters)
                if returned[0] != 0:
                    return -1 - k
                for i in range(m):
                    if not math.isfinite(wanted[i]):
                        return -1 - k
                    total[i] = wanted[i]
                    u[i] = min(max(total[i], tube.minimum[i]), tube.maximum[i])
        if not called:
            tube_step(tube, memory, watch, k, False, estimate, q_f[0], x_r, u_r, x_n, u_n, s, u_feedback, total, u)
        for i in range(m):
            beside[line, U_UNSATURATED + i] = total[i]
        for i in range(m):
            flown[line, U + i] = u[i]
        if planned:
            nominal_advance(nominal.polytope, measurement[0], measurement[1], x_n, u_n, defect, weights, S, new)
        for i in range(m):
            actuator[i] = u[i]
        if plant_faults is not None:
            receive(link, link_state, k, plant.seed, actuator)
        if k >= first_fault:
            for i in range(len(ended)):
                apply_command_faults(faults[i].rows, faults[i].memory, k, faults[i].seed, actuator, i)
        for i in range(m):
            flown[line, ACTUATOR + i] = actuator[i]
        inside = in_model_range(x, vehicle.angle_limit)
        if not every(inside):
            flying = 0
            for i in range(len(ended)):
                if ended[i] > k:
                    if lane(inside, i):
                        flying += 1
                    else:
                        ended[i] = k + 1
            if flying == 0:
                return k + 1
    return stop


def fly(components: Components) -> Flight:
    """Fly ``components`` from the plant's initial trim to the end of its duration, or until it diverges.

    The loop is compiled; a nominal law that solves a problem in flight and a controller of one's own in Python are
    called from it. Flights with such a block wait for one another: it has one state. With a controller in a shared
    library the loop flies in a child process, and flights wait for one another, too.

    Raises:
        ControllerError: A controller of one's own failed; it is named, with the step.
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
    """Tell whether equipment, links and air are ideal, and what the controller is given is the state."""
    injector = components.fault_injector
    # Of an estimator, whose sensors are hardly ideal, one function is enough.
    return (
        components.plant.is_ideal(injector.known) and injector.link.ideal and components.notch_filter.estimator is None
    )


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


def fly_into(history: History, components: Components) -> int:
    """Fly ``components`` in this process, as many steps as ``history`` has rows; return how many were flown.

    Raises:
        ControllerError, ParameterError: As :func:`fly`.
    """
    plant, nominal, controller = components.plant, components.nominal_trajectory, components.controller
    notch, injector = components.notch_filter, components.fault_injector
    faults = CommandFaults.of(components)
    tube = controller.kernel if controller.compiled_with_loop else no_tube(plant.vehicle)
    given, cuts, arrays = _loop_arrays(2 * len(notch.data.D), memory_of(tube), watch_of(tube))
    nominal_call = controller_call = NO_CALL
    callbacks = []
    if not nominal.law.compiled_with_loop:
        callbacks.append(_solving(nominal.law, arrays))
        nominal_call = callbacks[-1].call
    if not controller.compiled_with_loop:
        if controller.kernel is None:
            callbacks.append(_controlling(controller, given, cuts, arrays.wanted))
            controller_call = callbacks[-1].call
        else:
            address, state, parameters = controller.kernel
            memory = state.copy()
            controller_call = call_of(address, given, arrays.wanted, memory, parameters)
    ideal = is_ideal(components)
    with _ONE_AT_A_TIME if callbacks else nullcontext():
        if callbacks:
            nominal.law.reset()
            controller.reset()
        rows = fly_loop(
            plant.initial.state.copy(),
            plant.data,
            plant.memory(),
            None if ideal else PlantFaults.of(injector.known, plant.period),
            notch.estimator.data if notch.estimator else None,
            notch.data,
            nominal.data,
            nominal_call,
            tube,
            controller_call,
            None if ideal else injector.link,
            None if ideal else injector.link_state(),
            (faults,),
            faults.first,
            nominal.reference.data,
            arrays,
            Workspace.of(np.zeros, notch.data, nominal.data),
            history._replace(estimated=None) if ideal else history,
            np.full(1, len(history.flown)),
            0,
            len(history.flown),
        )
    for callback in callbacks:
        if callback.error is not None:
            raise callback.error
    if rows < 0:
        if code := int(arrays.returned[0]):
            raise ControllerError(f"{controller.name}, step {-1 - rows}: returned {code}, expected 0")
        raise controller.failure(-1 - rows, f"answered {arrays.wanted.tolist()}")
    if ideal and history.estimated is not None:
        history.estimated[:rows] = history.state[:rows]
    return rows


def _solving(law: NominalLaw, arrays: LoopArrays) -> Callback:
    def solve(step: int) -> None:
        chosen = law.step(arrays.deviation.copy())
        arrays.nominal_input[:], arrays.gain_index[0] = chosen.input, chosen.gain_index

    return Callback(solve)


def _controlling(controller: Controller, given: np.ndarray, cuts: list[slice], wanted: np.ndarray) -> Callback:
    def control(step: int) -> None:
        # A copy: a controller may keep what it was given.
        now = given.copy()
        estimate, filtered_pitch_rate, *others = [now[cut] for cut in cuts]
        inputs = ControllerInput(step, estimate, float(filtered_pitch_rate[0]), *others)
        wanted[0], wanted[1] = controller.wanted(inputs)

    return Callback(control)

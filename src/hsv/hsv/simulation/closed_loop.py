"""The closed loop in one process, compiled: the same arithmetic, in the same order, as the graph of nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from hsv.control.controller import Controller, ControllerInput
from hsv.control.nominal_law import FamilyLaw, nominal_input
from hsv.control.nominal_trajectory import NominalTrajectory, nominal_advance
from hsv.control.notch_filter import NotchFilter, filter_step, rest
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeLaw, memory_of, tube_step
from hsv.faults.actuator import FaultInjector, apply_faults
from hsv.simulation.fingerprint import fingerprint
from hsv.simulation.metrics import FlightData
from hsv.vehicle.dynamics import PITCH_RATE
from hsv.vehicle.envelope import in_model_range
from hsv.vehicle.integration import advance, workspace
from hsv.vehicle.plant import FlightStatus, Plant


@dataclass
class Components:
    """The five parts of the loop, as the five nodes hold them."""

    plant: Plant
    notch_filter: NotchFilter
    nominal_trajectory: NominalTrajectory
    controller: Controller
    fault_injector: FaultInjector

    def perturbed(self, perturbation: Mapping[str, float]) -> Components:
        """Return the loop around the perturbed vehicle, relative changes by parameter name; the rest is shared."""
        plant = self.plant
        vehicle = plant.vehicle.perturbed(perturbation)
        return replace(self, plant=Plant(vehicle, plant.initial, plant.period, plant.steps, plant.substeps))


class History(NamedTuple):
    """Rows k = 0 ... n of everything that a flight produced, SI."""

    state: np.ndarray
    """x (n + 1, 9)"""
    filtered_pitch_rate: np.ndarray
    """q_f (n + 1), rad/s"""
    deviation: np.ndarray
    """x_n (n + 1, 9)"""
    nominal_input: np.ndarray
    """u_n (n + 1, 2)"""
    gain_index: np.ndarray
    """(n + 1)"""
    u_unsaturated: np.ndarray
    """(n + 1, 2)"""
    command: np.ndarray
    """(n + 1, 2)"""
    actuator: np.ndarray
    """(n + 1, 2)"""

    @classmethod
    def empty(cls, rows: int) -> History:
        """Return room for ``rows`` steps."""
        widths = (9, 0, 9, 2, 0, 2, 2, 2)
        return cls(*(np.empty((rows, w)) if w else np.empty(rows) for w in widths))


@njit(cache=True, nogil=True)
def _fly(
    vehicle: Any,
    period: float,
    substeps: int,
    notch: Any,
    nominal: Any,
    tube: Any,
    faults: Any,
    reference: Any,
    x: np.ndarray,
    memory: np.ndarray,
    work: np.ndarray,
    history: Any,
) -> int:
    """Fly as many steps as ``history`` has rows, from ``x``; return the number of rows written (fewer: diverged)."""
    n, m = len(x), 2
    filter_state = np.zeros(2 * len(notch.D))
    rest(notch, x[PITCH_RATE], filter_state)
    s = filter_state.copy()
    last = len(reference.state) - 1
    S, x_n, new = np.empty(n * (n + m)), np.empty(n), np.empty(n)
    for i in range(n):
        x_n[i] = x[i] - reference.state[min(max(-reference.first, 0), last), i]
    u_n, u_feedback, total, u, actuator = np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    # Copies, made when another row holds: views of rows in every step take a twentieth of the loop's time.
    x_r, u_r, defect, row = np.empty(n), np.empty(m), np.empty(n), -1
    rows = len(history.filtered_pitch_rate)
    for k in range(rows):
        if k > 0:
            advance(x, actuator, vehicle, period, substeps, work)
        for i in range(n):
            history.state[k, i] = x[i]
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
        q_f = filter_step(notch, filter_state, x[PITCH_RATE])
        history.filtered_pitch_rate[k] = q_f
        for i in range(n):
            history.deviation[k, i] = x_n[i]
        index, _ = nominal_input(nominal, x_n, u_n)
        history.gain_index[k] = index
        for i in range(m):
            history.nominal_input[k, i] = u_n[i]
        tube_step(tube, memory, k, False, x, q_f, s, x_r, u_r, x_n, u_n, u_feedback, total, u)
        for i in range(m):
            history.u_unsaturated[k, i] = total[i]
        for i in range(m):
            history.command[k, i] = u[i]
        nominal_advance(nominal.polytope, x[0], x[1], x_n, u_n, defect, S, new)
        apply_faults(faults, k, u, actuator)
        for i in range(m):
            history.actuator[k, i] = actuator[i]
        if not in_model_range(x):
            return k + 1
    return rows


@dataclass(frozen=True)
class Flight:
    """A flight: ``period`` (s), what happened at each step, along which reference, time of the first fault."""

    period: float
    history: History
    trajectory: ReferenceTrajectory
    fault_start: float | None
    status: FlightStatus

    @property
    def time(self) -> np.ndarray:
        """Simulated time (n + 1), s."""
        return np.arange(len(self.history.state)) * self.period

    @cached_property
    def reference(self) -> np.ndarray:
        """x_r (n + 1, 9)."""
        return self._along(self.trajectory.data.state)

    @cached_property
    def reference_input(self) -> np.ndarray:
        """u_r (n + 1, 2)."""
        return self._along(self.trajectory.data.input)

    @cached_property
    def defect(self) -> np.ndarray:
        """d_r (n + 1, 9), see :mod:`hsv.control.reference_trajectory`."""
        return self._along(self.trajectory.data.defect)

    def _along(self, rows: np.ndarray) -> np.ndarray:
        return np.asarray(rows[self.trajectory.rows(len(self.history.state))])

    @property
    def fingerprint(self) -> str:
        """The digest of all its bits, see :mod:`hsv.simulation.fingerprint`."""
        h = self.history
        return fingerprint(h.state, h.filtered_pitch_rate, h.deviation, h.nominal_input, h.command, h.actuator)

    def data(self) -> FlightData:
        """Return what the metrics are made of."""
        h = self.history
        return FlightData(
            time=self.time,
            state=h.state,
            reference=self.reference,
            deviation=h.deviation,
            command=h.command,
            saturated=h.command != h.u_unsaturated,
            gain_index=h.gain_index,
            fault_start=self.fault_start,
        )


def fly(components: Components) -> Flight:
    """Fly ``components`` from the plant's initial trim to the end of its duration, or until it diverges.

    The nested family under the tube law flies compiled, whatever else step by step; both give the same bits.
    """
    law = components.controller
    if isinstance(law, TubeLaw | RobustMpc) and isinstance(components.nominal_trajectory.law, FamilyLaw):
        return _flight(components, _fly_compiled(components, law))
    return fly_stepwise(components)


def fly_stepwise(components: Components) -> Flight:
    """Fly as :func:`fly` does, through the ``step()`` of every component, as the nodes of the graph do."""
    plant, notch, nominal = components.plant, components.notch_filter, components.nominal_trajectory
    law, injector = components.controller, components.fault_injector
    for component in (notch, nominal, law, injector):
        component.reset()
    history = History.empty(plant.steps + 1)
    current = plant.reset()
    for k in range(plant.steps + 1):
        if k > 0:
            current = plant.step(history.actuator[k - 1])
        filtered = notch.step(float(current.state[PITCH_RATE]))
        planned = nominal.step(current.state)
        applied = law.step(
            ControllerInput(
                k,
                current.state,
                filtered.filtered_pitch_rate,
                filtered.filter_state,
                planned.reference,
                planned.reference_input,
                planned.deviation,
                planned.input,
            )
        )
        history.state[k] = current.state
        history.filtered_pitch_rate[k] = filtered.filtered_pitch_rate
        history.deviation[k] = planned.deviation
        history.nominal_input[k] = planned.input
        history.gain_index[k] = planned.gain_index
        history.u_unsaturated[k] = applied.u_unsaturated
        history.command[k] = applied.input
        history.actuator[k] = injector.step(k, applied.input).actuator
        if current.status is FlightStatus.DIVERGED:
            history = History(*(column[: k + 1] for column in history))
            break
    return _flight(components, history)


def _fly_compiled(components: Components, law: TubeLaw | RobustMpc) -> History:
    plant, nominal = components.plant, components.nominal_trajectory
    history = History.empty(plant.steps + 1)
    rows = _fly(
        plant.vehicle,
        plant.period,
        plant.substeps,
        components.notch_filter.data,
        nominal.data,
        law.data,
        components.fault_injector.schedule,
        nominal.reference.data,
        plant.initial.state.copy(),
        memory_of(law.data),
        workspace(),
        history,
    )
    return History(*(column[:rows] for column in history))


def _flight(components: Components, history: History) -> Flight:
    plant = components.plant
    diverged = not in_model_range(history.state[-1])
    status = FlightStatus.DIVERGED if diverged else FlightStatus.FINISHED
    starts = components.fault_injector.schedule.start
    fault_start = float(starts.min() * plant.period) if len(starts) and starts.min() < len(history.state) else None
    return Flight(plant.period, history, components.nominal_trajectory.reference, fault_start, status)

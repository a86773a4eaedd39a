"""An optimum flown by the loop's plant and fault injector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.model.dynamics import VehicleParameters, advance, transitions
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.schedule import ScheduledFault
from hsv.model.faults.table import Fault
from hsv.model.plant import FlightStatus, Plant
from hsv.model.signals import N_INPUTS, N_STATES, NEVER
from hsv.model.trim import Trim, trim
from hsv_paper.limits.optimum import INPUT_SCALE, STATE_SCALE, Point, Problem

_LAST_WEIGHT = 100.0
"""Weight of a deviation at the end of the flight, against those before."""


@dataclass(frozen=True)
class Flown:
    """A flight along an optimum: commands (N, 2), states (N + 1, 9), and the states of the optimum (N + 1, 9).

    finished: It stayed within the model's range.
    """

    period: float
    command: np.ndarray
    state: np.ndarray
    wanted: np.ndarray
    finished: bool

    @property
    def time(self) -> np.ndarray:
        """Times (N + 1) of the states, s."""
        return self.period * np.arange(len(self.state))

    def deviation(self, after: float = 0.0) -> float:
        """Return the largest deviation from the optimum from a time (s) on, in :data:`STATE_SCALE`."""
        if not self.finished:
            return np.inf
        return float((np.abs(self.state - self.wanted)[self.time >= after - 1e-9] / STATE_SCALE).max())


def fly_optimum(
    problem: Problem, optimum: Point, held: np.ndarray, after: float, effectiveness: float = 1.0, kept: int = 0
) -> Flown:
    """Fly the inputs of an ``optimum``, then the input of the trim that it leads to.

    On this unstable vehicle, rounding grows by a factor of e in 0.6 s. A time-varying regulator along the optimum
    therefore corrects the inputs, within U.

    Args:
        problem: The problem; all of its periods are whole numbers of one length.
        optimum: Its optimum.
        held: (N) those numbers.
        after: Time (s) flown after the end of the optimum.
        effectiveness: Of the elevator, from the beginning; the optimum's inputs are those that act.
        kept: Number of periods at the beginning in which the command is that of the trim.
    """
    vehicle = problem.vehicle
    period, substeps = float(problem.periods(optimum.scalar)[0] / held[0]), int(problem.substeps[0] // held[0])
    end, extra = trim(vehicle, *optimum.state[-1, :2]), round(after / period)
    inputs = np.array([*np.repeat(optimum.input, held, axis=0), *[end.input] * extra])
    # Each period starts at the state of the optimum, from which the states within it follow.
    wanted = [optimum.state[0]]
    for k, count in enumerate(held):
        x = optimum.state[k]
        for _ in range(count):
            x = advance(x, optimum.input[k], vehicle, period, substeps)
            wanted.append(x)
    states = np.array(wanted + [end.state] * extra)
    gains = _regulator(vehicle, period, substeps, states, inputs)
    before = trim(vehicle, *optimum.state[0, :2])
    plant = Plant(vehicle, Trim(states[0], before.input, 0.0), period, len(inputs), substeps)
    loss = Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": effectiveness})
    injector = FaultInjector([ScheduledFault(loss, 0, NEVER)], period)
    command, flown = np.empty((len(inputs), N_INPUTS)), [plant.reset().state]
    for step in range(len(inputs)):
        wish = (inputs[step] - gains[step] @ (flown[-1] - states[step])) / [1.0, effectiveness]
        command[step] = before.input if step < kept else np.clip(wish, vehicle.input_minimum, vehicle.input_maximum)
        left = injector.step(step, command[step])
        result = plant.step(left.actuator, left.active)
        flown.append(result.state)
        if result.status is FlightStatus.DIVERGED:
            return Flown(period, command[: step + 1], np.array(flown), states, False)
    return Flown(period, command, np.array(flown), states, True)


def _regulator(
    vehicle: VehicleParameters, period: float, substeps: int, states: np.ndarray, inputs: np.ndarray
) -> np.ndarray:
    """Return the gains (N, 2, 9) of the linear-quadratic regulator along a trajectory, weighted by the scales."""
    n = len(inputs)
    _, slope = transitions(states[:-1], inputs, np.full(n, period), np.full(n, substeps), vehicle)
    weight, price = np.diag(STATE_SCALE**-2.0), np.diag(INPUT_SCALE**-2.0)
    cost, gains = _LAST_WEIGHT * weight, np.empty((n, N_INPUTS, N_STATES))
    for k in range(n - 1, -1, -1):
        by_state, by_input = slope[k, :, :N_STATES], slope[k, :, N_STATES:-1]
        gains[k] = np.linalg.solve(price + by_input.T @ cost @ by_input, by_input.T @ cost @ by_state)
        cost = weight + by_state.T @ cost @ (by_state - by_input @ gains[k])
        cost = 0.5 * (cost + cost.T)
    return gains

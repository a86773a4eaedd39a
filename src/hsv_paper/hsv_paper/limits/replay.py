"""An optimum flown by the loop's plant and fault injector, and its commands replayed."""

from __future__ import annotations

from collections.abc import Callable
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
class Loop:
    """What a flight needs besides commands: vehicle, period (s), its Runge-Kutta steps, elevator effectiveness."""

    vehicle: VehicleParameters
    period: float
    substeps: int
    effectiveness: float = 1.0

    def fly(
        self, start: np.ndarray, steps: int, law: Callable[[int, np.ndarray], np.ndarray]
    ) -> tuple[np.ndarray, bool]:
        """Return the states (steps + 1, 9) of a flight, and whether it stayed within the model's range.

        Args:
            start: State (9).
            steps: Number of periods.
            law: Command (2) of a step and its state.
        """
        plant = Plant(self.vehicle, Trim(start, law(0, start), 0.0), self.period, steps, self.substeps)
        loss = Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": self.effectiveness})
        injector = FaultInjector([ScheduledFault(loss, 0, NEVER)], self.period)
        states = np.empty((steps + 1, N_STATES))
        states[0] = plant.reset().state
        for step in range(steps):
            left = injector.step(step, law(step, states[step]))
            result = plant.step(left.actuator, left.active)
            states[step + 1] = result.state
            if result.status is FlightStatus.DIVERGED:
                return states[: step + 2], False
        return states, True


@dataclass(frozen=True)
class Flown:
    """A flight along an optimum: commands (N, 2), states (N + 1, 9), and the states of the optimum (N + 1, 9).

    finished: It stayed within the model's range.
    """

    loop: Loop
    command: np.ndarray
    state: np.ndarray
    wanted: np.ndarray
    finished: bool

    @property
    def time(self) -> np.ndarray:
        """Times (N + 1) of the states, s."""
        return self.loop.period * np.arange(len(self.state))

    def deviation(self, after: float = 0.0) -> float:
        """Return the largest deviation from the optimum from a time (s) on, in :data:`STATE_SCALE`."""
        if not self.finished:
            return np.inf
        return float((np.abs(self.state - self.wanted)[self.time >= after - 1e-9] / STATE_SCALE).max())

    def replayed(self) -> np.ndarray:
        """Return the states of the commands alone, flown from the same state without looking at any other."""
        return self.loop.fly(self.state[0], len(self.command), lambda step, _: self.command[step])[0]


def fly_optimum(
    problem: Problem, optimum: Point, held: np.ndarray, after: float, effectiveness: float = 1.0, kept: int = 0
) -> Flown:
    """Fly the inputs of an ``optimum``, then the input of the trim that it leads to.

    On this unstable vehicle, rounding grows by a factor of e in 0.6 s. A time-varying regulator along the optimum
    therefore corrects the inputs, within U; what it commands is by itself a history of inputs within U, which
    :meth:`Flown.replayed` flies.

    Args:
        problem: The problem; all of its periods are whole numbers of one length.
        optimum: Its optimum.
        held: (N) those numbers.
        after: Time (s) flown after the end of the optimum.
        effectiveness: Of the elevator, from the beginning; the optimum's inputs are those that act.
        kept: Number of periods at the beginning in which the command is that of the trim.
    """
    vehicle = problem.vehicle
    period = float(problem.periods(optimum.scalar)[0] / held[0])
    loop = Loop(vehicle, period, int(problem.substeps[0] // held[0]), effectiveness)
    wanted, acting = [optimum.state[0]], []
    for k, count in enumerate(held):
        x = optimum.state[k]
        for _ in range(count):
            x = advance(x, optimum.input[k], vehicle, period, loop.substeps)
            wanted.append(x)
            acting.append(optimum.input[k])
    end = trim(vehicle, *optimum.state[-1, :2])
    extra = round(after / period)
    states, inputs = np.array(wanted + [end.state] * extra), np.array(acting + [end.input] * extra)
    gains = _regulator(loop, states, inputs)
    before = trim(vehicle, *optimum.state[0, :2]).input
    command = np.empty((len(inputs), N_INPUTS))

    def law(step: int, state: np.ndarray) -> np.ndarray:
        wish = (inputs[step] - gains[step] @ (state - states[step])) / [1.0, effectiveness]
        command[step] = before if step < kept else np.clip(wish, vehicle.input_minimum, vehicle.input_maximum)
        return command[step]

    flown, finished = loop.fly(states[0], len(inputs), law)
    return Flown(loop, command, flown, states, finished)


def _regulator(loop: Loop, states: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return the gains (N, 2, 9) of the linear-quadratic regulator along a trajectory, weighted by the scales."""
    n = len(inputs)
    lengths, substeps = np.full(n, loop.period), np.full(n, loop.substeps)
    _, slope = transitions(states[:-1], inputs, lengths, substeps, loop.vehicle)
    weight, price = np.diag(STATE_SCALE**-2.0), np.diag(INPUT_SCALE**-2.0)
    cost, gains = _LAST_WEIGHT * weight, np.empty((n, N_INPUTS, N_STATES))
    for k in range(n - 1, -1, -1):
        by_state, by_input = slope[k, :, :N_STATES], slope[k, :, N_STATES:-1]
        gains[k] = np.linalg.solve(price + by_input.T @ cost @ by_input, by_input.T @ cost @ by_state)
        cost = weight + by_state.T @ cost @ (by_state - by_input @ gains[k])
        cost = 0.5 * (cost + cost.T)
    return gains

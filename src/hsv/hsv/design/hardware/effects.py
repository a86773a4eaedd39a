"""Contributions of hardware and air models to the disturbance set of a design.

Sensors, wind and density add channels to the structured set, bounded as if they could take any value within at every
step. Errors of a measurement act through the feedback and the notch filter, and through the scheduling of the nominal
model. Samples that come late add states. What a scenario declares of such models is said by
:mod:`hsv.design.hardware.declared`, whether a design is certified with them by
:mod:`hsv.design.hardware.verdict`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hsv.design.disturbance import CHANNELS, DisturbanceSet
from hsv.design.error_system import ErrorSystem
from hsv.design.hardware.plan import Plan
from hsv.design.sets.problem import TubeProblem
from hsv.model.dynamics import derivative
from hsv.model.lpv.linearisation import linearise, zero_order_hold
from hsv.model.sensors import ALPHA, PITCH
from hsv.model.signals import N_RIGID, N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle

_WIND_FORWARD, _WIND_UP, _DENSITY = 0, 1, 2
"""Indices into the conditions that :func:`hsv.model.dynamics.forces` takes."""

N_SCHEDULING = 2
"""The nominal model is scheduled by the first states, altitude and velocity."""

_STILL = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])

_STEP = np.array([1.0, 1.0, 1e-3])
"""Differences over which wind (m/s) and density are linearised, the error of a central difference far below one part in
a million."""


@dataclass(frozen=True)
class Effect:
    """A model as an addition to the disturbance set.

    ``columns`` (r, n, c) of its channels, ``feedthrough`` (2, c) to the feedback, ``half_width`` (c) of their bounds.
    """

    columns: np.ndarray
    feedthrough: np.ndarray
    half_width: np.ndarray
    widening: np.ndarray = field(default_factory=lambda: np.zeros(len(CHANNELS)))
    """Increase of both bounds of the structured set (7)."""
    late: np.ndarray = field(default_factory=lambda: np.zeros(N_RIGID, int))
    """Steps (5) by which each rigid state is seen late"""


Model = Callable[[ErrorSystem], Effect]
"""Function from the error system on which a model acts to the effect of the model."""


@dataclass(frozen=True)
class Measured:
    """Sensors of the rigid states: largest ``error`` (5), SI, and how many steps ``late`` (5) each is.

    ``inertial``: the angle of attack has the error of the pitch angle, too. ``plan``: without one the nominal model is
    scheduled with the truth.
    """

    error: np.ndarray
    late: np.ndarray = field(default_factory=lambda: np.zeros(N_RIGID, int))
    inertial: bool = False
    plan: Plan | None = None

    def __call__(self, system: ErrorSystem) -> Effect:
        """Return the effect on ``system``; :func:`delayed` adds the delay of the error e."""
        columns, seen = entering(system), system.F[:, :N_RIGID].copy()
        error, widening = self.error, np.zeros(len(CHANNELS))
        if self.plan:
            # A late sample is one of the plan as it was, and of the error as it was, anywhere else in the set.
            error = error + self.plan.change(self.late)
            apart = np.where(self.late > 0, 2.0 * self.plan.half_width, 0.0)
            if (error + apart)[:N_SCHEDULING].any():
                widening = self.plan.scheduling((error + apart)[:N_SCHEDULING])
        if self.inertial:
            columns[:, :, PITCH] += columns[:, :, ALPHA]
            seen[:, PITCH] += seen[:, ALPHA]
        return Effect(columns, seen, error, widening, self.late)


def entering(system: ErrorSystem) -> np.ndarray:
    """Return the effect of a measurement of the rigid states (r, n, 5) in a period, by feedback and notch filter."""
    columns = system.B @ system.F[:, :N_RIGID]
    filtered = np.array([name.startswith("filter_") for name in system.names])
    columns[:, filtered, PITCH_RATE] += system.A[:, filtered, PITCH_RATE]
    return np.asarray(columns)


def delayed(system: ErrorSystem, late: np.ndarray) -> ErrorSystem:
    """Return ``system`` with rigid states that are seen so many steps ``late`` (5): samples under way are states."""
    columns, n, extra = entering(system), len(system.names), int(late.sum())
    whole = n + extra
    A = np.zeros((len(system.A), whole, whole))
    A[:, :n, :n] = system.A
    F = np.concatenate((system.F, np.zeros((len(system.F), extra))), axis=1)
    first, names = n, list(system.names)
    for i, steps in enumerate(map(int, late)):
        if steps == 0:
            continue
        last = first + steps - 1
        A[:, :n, i] -= columns[:, :, i]
        A[:, :n, last] += columns[:, :, i]
        A[:, first, i] = 1.0
        for j in range(first + 1, last + 1):
            A[:, j, j - 1] = 1.0
        F[:, last], F[:, i] = system.F[:, i], 0.0
        names += [f"{system.names[i]}_late_{j + 1}" for j in range(steps)]
        first = last + 1
    room = ((0, 0), (0, extra), (0, 0))
    B, G = np.pad(system.B, room), np.pad(system.G, room)
    return ErrorSystem(A, B, G, F, system.F_d, tuple(names), system.unseen + extra)


def air(vehicle: Vehicle, period: float, forward: float = 0.0, up: float = 0.0, density: float = 0.0) -> Model:
    """Return the model of air with bounded velocities (m/s) and a bounded relative error of the density.

    Its effect is that at mid-envelope, held over a ``period`` (s).
    """
    bounds = np.array([forward, up, density])

    def effect(system: ErrorSystem) -> Effect:
        point = trim(vehicle.decoupled, *vehicle.centre)
        slopes = np.empty((N_STATES, len(bounds)))
        for column, (index, step) in enumerate(zip((_WIND_FORWARD, _WIND_UP, _DENSITY), _STEP, strict=True)):
            ends = []
            for sign in (1.0, -1.0):
                conditions = _STILL.copy()
                conditions[index] += sign * step
                ends.append(derivative(point.state, point.input, vehicle.decoupled, conditions))
            slopes[:, column] = (ends[0] - ends[1]) / (2.0 * step)
        A, _ = linearise(vehicle.decoupled, *vehicle.centre)
        rigid = zero_order_hold(A[:N_RIGID, :N_RIGID], slopes[:N_RIGID], period)[1]
        columns = np.zeros((*system.A.shape[:2], len(bounds)))
        columns[:, :N_RIGID] = rigid
        return Effect(columns, np.zeros((len(system.F), len(bounds))), bounds)

    return effect


def with_models(problem: TubeProblem, models: Sequence[Model]) -> TubeProblem:
    """Return ``problem`` with the additional channels of ``models``, except those that are bounded by zero.

    Samples of a state that several make late are late by the sum.
    """
    system, disturbance = problem.system, problem.disturbance
    late = np.zeros(N_RIGID, int)
    for model in models:
        added = model(problem.system)
        late = late + added.late
        widening = np.pad(added.widening, (0, len(disturbance.lower) - len(added.widening)))
        disturbance = DisturbanceSet(disturbance.lower - widening, disturbance.upper + widening)
        acting = added.half_width > 0.0
        half_width = added.half_width[acting]
        system = replace(
            system,
            G=np.concatenate((system.G, added.columns[:, :, acting]), axis=2),
            F_d=np.concatenate((system.F_d, added.feedthrough[:, acting]), axis=1),
        )
        disturbance = DisturbanceSet(
            np.append(disturbance.lower, -half_width), np.append(disturbance.upper, half_width)
        )
    return TubeProblem(delayed(system, late) if late.any() else system, disturbance)


def unexplained(plan: Plan, equipment: Mapping[str, Any]) -> Model:
    """Return by how much the structured set has to be wider for flights with ``equipment``: sensors.

    Raises:
        DesignError: A flight is lost or limited.
    """
    widening = plan.remeasured(equipment)

    def effect(system: ErrorSystem) -> Effect:
        nothing = np.zeros(0)
        return Effect(np.zeros((*system.A.shape[:2], 0)), np.zeros((len(system.F), 0)), nothing, widening)

    return effect

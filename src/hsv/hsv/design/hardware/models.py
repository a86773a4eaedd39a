"""Models of hardware and air as additions to the disturbance set of a design.

Sensors, wind and density add channels to the structured set; a channel may take any value within its bounds at every
step. Measurement errors act through the feedback and the notch filter, and through the scheduling of the nominal model.
Delayed samples add states. A scenario or the options of ``hsv certify`` declare the models. The bound of noise is
:data:`REACH` standard deviations. Effects without a known bound are listed, and prevent certification.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError, QuantityError, one_of
from hsv.base.units import parse_quantity
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.core import Struct
from hsv.core.arithmetic import LARGEST
from hsv.design.certified import CertifiedDesign, Plan
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem
from hsv.design.tube_problem import TubeProblem
from hsv.flight.scenario import Scenario
from hsv.model.actuators import ACTUATOR_PARAMETERS, IDEAL
from hsv.model.atmosphere import atmosphere_data
from hsv.model.dynamics import derivative
from hsv.model.links import command_link, computation, measurement_link
from hsv.model.lpv.linearisation import linearise, zero_order_hold
from hsv.model.sensors import ALPHA, PITCH, SENSOR_SETS, sensor_data
from hsv.model.signals import CHANNELS, INPUT_NAMES, N_RIGID, N_STATES, PITCH_RATE, STATE_NAMES, STATE_UNITS
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle

REACH = 3.0
"""Standard deviations that count as the bound of noise and turbulence: one sample in 370 exceeds it."""

LARGEST_REACH = float(np.ceil(1e3 * LARGEST)) / 1e3
"""Largest magnitude of the generated standard normal numbers, rounded up to three decimals."""

N_SCHEDULING = 2
"""Number of states by which the nominal model is scheduled: the first two, altitude and velocity."""

_STILL = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0])
"""The ``conditions`` of :func:`hsv.model.dynamics.forces` in still air, with a working engine."""

_STEP = np.array([1.0, 1.0, 1e-3])
"""Steps of the central differences in the first three conditions: wind forward and up (m/s), relative density."""


@dataclass(frozen=True)
class Effect:
    """The effect of a model of hardware or air on the error system: c further channels, wider bounds, and delays.

    ``columns`` (r, n, c): effect of the channels on e at each vertex; ``feedthrough`` (2, c): their effect on the
    feedback; ``half_width`` (c): their bounds, about zero. ``widening``, shape (7,): extension of the structured set on
    both sides. ``late``, shape (5,): delays of the measured rigid states, in steps.
    """

    columns: np.ndarray
    feedthrough: np.ndarray
    half_width: np.ndarray
    widening: np.ndarray = field(default_factory=lambda: np.zeros(len(CHANNELS)))
    late: np.ndarray = field(default_factory=lambda: np.zeros(N_RIGID, int))


Model = Callable[[ErrorSystem], Effect]
"""A model of hardware or air: a function that returns its effect on a given error system."""


@dataclass(frozen=True)
class Measured:
    """The model of sensors of the rigid states, with errors up to ``error`` (SI) and delays ``late`` (steps), by state.

    ``inertial``: the angle of attack also has the error of the pitch angle. ``plan``: the plan, whose change during a
    delay is an error, too; None: no such error, and no errors in the scheduling of the nominal model.
    """

    error: np.ndarray
    late: np.ndarray = field(default_factory=lambda: np.zeros(N_RIGID, int))
    inertial: bool = False
    plan: Plan | None = None

    def __call__(self, system: ErrorSystem) -> Effect:
        """Return the effect of the sensors on ``system``; :func:`delayed` adds the delay of the error e itself."""
        columns, seen = entering(system), system.F[:, :N_RIGID].copy()
        error, widening = self.error, np.zeros(len(CHANNELS))
        if self.plan:
            # A late sample contains the plan and the error of an earlier step; that error may be anywhere in the set.
            error = error + self.plan.change(self.late)
            apart = np.where(self.late > 0, 2.0 * self.plan.half_width, 0.0)
            if (error + apart)[:N_SCHEDULING].any():
                widening = self.plan.scheduling((error + apart)[:N_SCHEDULING])
        if self.inertial:
            columns[:, :, PITCH] += columns[:, :, ALPHA]
            seen[:, PITCH] += seen[:, ALPHA]
        return Effect(columns, seen, error, widening, self.late)


def entering(system: ErrorSystem) -> np.ndarray:
    """Return the changes (r, n, 5) of e over one period, at each vertex, due to unit errors of the 5 measured states.

    The measured rigid states act through the feedback and the notch filter.
    """
    columns = system.B @ system.F[:, :N_RIGID]
    filtered = np.array([name.startswith("filter_") for name in system.names])
    columns[:, filtered, PITCH_RATE] += system.A[:, filtered, PITCH_RATE]
    return np.asarray(columns)


def delayed(system: ErrorSystem, late: np.ndarray) -> ErrorSystem:
    """Return ``system`` with rigid state i measured ``late[i]`` steps late; the delayed samples are appended states."""
    columns, n, extra = entering(system), len(system.names), int(late.sum())
    room = ((0, 0), (0, extra), (0, 0))
    A, B, G = np.pad(system.A, ((0, 0), (0, extra), (0, extra))), np.pad(system.B, room), np.pad(system.G, room)
    F, first, names = np.pad(system.F, ((0, 0), (0, extra))), n, list(system.names)
    for i in np.flatnonzero(late):
        last = first + late[i] - 1
        A[:, :n, i] -= columns[:, :, i]
        A[:, :n, last] += columns[:, :, i]
        A[:, first, i] = 1.0
        A[:, range(first + 1, last + 1), range(first, last)] = 1.0
        F[:, last], F[:, i] = system.F[:, i], 0.0
        names += [f"{system.names[i]}_late_{j + 1}" for j in range(late[i])]
        first = last + 1
    return ErrorSystem(A, B, G, F, system.F_d, tuple(names), system.unseen + extra)


def air(vehicle: Vehicle, period: float, forward: float = 0.0, up: float = 0.0, density: float = 0.0) -> Model:
    """Return the model of air with bounds on wind ``forward`` and ``up`` (m/s) and on the relative ``density`` error.

    The effect is linearised at mid-envelope, with values held over a ``period`` (s).
    """
    bounds = np.array([forward, up, density])

    def effect(system: ErrorSystem) -> Effect:
        point, slopes = trim(vehicle.decoupled, *vehicle.centre), np.empty((N_STATES, len(bounds)))
        for column, step in enumerate(_STEP):
            moved = step * np.eye(len(_STILL))[column]
            above, below = (
                derivative(point.state, point.input, vehicle.decoupled, conditions)
                for conditions in (_STILL + moved, _STILL - moved)
            )
            slopes[:, column] = (above - below) / (2.0 * step)
        A, _ = linearise(vehicle.decoupled, *vehicle.centre)
        columns = np.zeros((*system.A.shape[:2], len(bounds)))
        columns[:, :N_RIGID] = zero_order_hold(A[:N_RIGID, :N_RIGID], slopes[:N_RIGID], period)[1]
        return Effect(columns, np.zeros((len(system.F), len(bounds))), bounds)

    return effect


def with_models(problem: TubeProblem, models: Sequence[Model]) -> TubeProblem:
    """Return ``problem`` with the effects of all ``models``; their channels with a bound of zero are omitted.

    If several models delay the same state, their delays add up.
    """
    system, lower, upper = problem.system, problem.disturbance.lower, problem.disturbance.upper
    late = np.zeros(N_RIGID, int)
    for model in models:
        added = model(problem.system)
        late, acting = late + added.late, added.half_width > 0.0
        widening = np.pad(added.widening, (0, len(lower) - len(added.widening)))
        lower = np.append(lower - widening, -added.half_width[acting])
        upper = np.append(upper + widening, added.half_width[acting])
        system = replace(
            system,
            G=np.concatenate((system.G, added.columns[:, :, acting]), axis=2),
            F_d=np.concatenate((system.F_d, added.feedthrough[:, acting]), axis=1),
        )
    return TubeProblem(delayed(system, late) if late.any() else system, DisturbanceSet(lower, upper))


def sensors(data: Struct, plan: Plan, reach: float = REACH, of: str = "sensor") -> dict[str, Model]:
    """Return the models of noise, bias, quantisation and latency of sensors, by name; those of size zero are omitted.

    Noise includes Gauss-Markov biases, and bias includes scale factors along the ``plan``. Random parts are bounded by
    ``reach`` standard deviations, and quantisation by half a quantum. Delays are exact. ``of``: prefix of the names.
    """
    rigid = slice(0, N_RIGID)
    scale = (np.abs(data.scale) + reach * data.scale_sigma)[rigid]
    errors = {
        f"{of} noise": reach * np.hypot(data.noise, data.drift_sigma)[rigid],
        f"{of} bias": (np.abs(data.bias) + reach * data.bias_sigma)[rigid] + scale * plan.largest(),
        f"{of} quantisation": 0.5 * data.quantum[rigid],
    }
    inertial = bool(data.inertial_angle_of_attack)
    models: dict[str, Model] = {
        name: Measured(error, inertial=inertial, plan=plan) for name, error in errors.items() if error.any()
    }
    if data.latency[rigid].any():
        models[f"{of} latency"] = Measured(np.zeros(N_RIGID), data.latency[rigid], plan=plan)
    return models


Declared = tuple[dict[str, Model], list[str]]
"""Models by name, and the names of effects without a known bound."""


def declared(subject: CertifiedDesign, scenario: Scenario, reach: float = REACH) -> Declared:
    """Return models of a scenario's sensors and air, by name, and the names of its effects without a known bound.

    Args:
        subject: The design.
        scenario: The scenario; for its actuators see :func:`declared_actuators`.
        reach: Number of standard deviations that counts as the bound of a normally distributed quantity.
    """
    values, period = scenario.parameters(), subject.design.period
    data, moving, plan = sensor_data(values, period), atmosphere_data(values, period), Plan.of(subject)
    models, unbounded = sensors(data, plan, reach), _without_bound(data, values, period)
    if models:
        equipment = {name: value for name, value in values.items() if name.startswith("sensors.") or name == "seed"}
        _remeasure(models, unbounded, plan, equipment)
    shear = abs(moving.shear) * max(abs(h - moving.shear_altitude) for h in subject.vehicle.altitude_range)
    bounds = {
        "wind": np.append(np.abs(moving.wind) + np.array([shear, 0.0]), 0.0),
        "gusts": np.append(np.abs(moving.gust).sum(axis=0) if len(moving.gust) else np.zeros(2), 0.0),
        "turbulence": np.append(reach * moving.sigma, 0.0),
        "density": np.array([0.0, 0.0, abs(moving.density_offset) + reach * moving.density_sigma]),
    }
    return models | _airs(subject, bounds), unbounded


def described(
    subject: CertifiedDesign,
    *,
    sensor_set: str = IDEAL,
    bias: Sequence[str] = (),
    gust: str = "0 ft/s",
    turbulence: str = "0 ft/s",
    density: str = "0 %",
    reach: float = REACH,
) -> Declared:
    """Return the models that options of ``hsv certify`` describe, by name, and the effects without a known bound.

    An option with the value zero gives no model.

    Args:
        subject: The design.
        sensor_set: Name of a published sensor set.
        bias: Magnitudes of constant biases of rigid states, each a text "state=quantity".
        gust: Bound of the wind forward and of the wind up, with unit.
        turbulence: Standard deviation of the turbulence forward and up, with unit.
        density: Bound of the relative error of the density.
        reach: Number of standard deviations that counts as the bound of a normally distributed quantity.

    Raises:
        QuantityError: A value is not readable or out of range, or a name is unknown.
    """
    if sensor_set not in SENSOR_SETS:
        raise QuantityError(f"sensors = {sensor_set!r}: expected {one_of(SENSOR_SETS, sensor_set)}")
    if not 0.0 < reach <= LARGEST_REACH:
        raise QuantityError(f"reach = {reach:g}: expected more than 0, up to {LARGEST_REACH}, beyond which no noise is")
    names, biases = STATE_NAMES[:N_RIGID], np.zeros(N_RIGID)
    for text in bias:
        name, _, value = text.partition("=")
        if name.strip() not in names:
            raise QuantityError(f"bias = {text!r}: expected {one_of(names, name, ', then = and a quantity')}")
        index = names.index(name.strip())
        biases[index] = abs(parse_quantity(value.strip(), STATE_UNITS[index], f"bias {names[index]}"))
    up_to = np.array([1.0, 1.0, 0.0])
    bounds = {}
    for option, text, unit, factor in (
        ("gust", gust, "m/s", up_to),
        ("turbulence", turbulence, "m/s", reach * up_to),
        ("density", density, "1", 1.0 - up_to),
    ):
        if (size := parse_quantity(text, unit, option)) < 0.0:
            raise QuantityError(f"{option} = {size:g}: expected zero or more")
        bounds[f"{option} {text}"] = size * factor
    models: dict[str, Model] = {}
    unbounded: list[str] = []
    if sensor_set != IDEAL or biases.any():
        plan, data = Plan.of(subject), sensor_data({"sensors.set": sensor_set}, subject.design.period)
        models |= sensors(data, plan, reach, f"{sensor_set} sensors:")
        if biases.any():
            models[f"bias of {', '.join(text.strip() for text in bias)}"] = Measured(biases, plan=plan)
        given = {f"sensors.{n}.bias": [float(b)] for n, b in zip(names, biases, strict=True) if b}
        _remeasure(models, unbounded, plan, {"sensors.set": sensor_set, **given})
    return models | _airs(subject, bounds), unbounded


def _airs(subject: CertifiedDesign, bounds: Mapping[str, np.ndarray]) -> dict[str, Model]:
    """Return a model of air for each non-zero triple in ``bounds``: wind forward and up (m/s), relative density."""
    return {name: air(subject.vehicle, subject.design.period, *of) for name, of in bounds.items() if of.any()}


def _without_bound(data: Struct, values: Mapping[str, Any], period: float) -> list[str]:
    """Return the names of the active effects without a known bound: of sensors, estimator, actuators and links."""
    limits = np.isfinite(np.r_[data.minimum[:N_RIGID], data.maximum[:N_RIGID]])
    changed = {p.name: bool(values.get(p.name)) for p in ACTUATOR_PARAMETERS if isinstance(p.default, list)}
    found = {
        "lag of a sensor": data.lag_decay[:N_RIGID].any(),
        "random walk of a sensor": data.walk[:N_RIGID].any(),
        "drop-out of a sensor": data.drop_out[:N_RIGID].any(),
        "range of a sensor": limits.any(),
        "estimator": values.get(ESTIMATOR_ENABLED.name, False),
        **changed,
        "link of the measurement": not measurement_link(values).ideal,
        "link of the command": not command_link(values, period).ideal or computation(values, period)[1] > 0.0,
    }
    return [name for name, there in found.items() if there]


def _remeasure(models: dict[str, Model], unbounded: list[str], plan: Plan, equipment: Mapping[str, Any]) -> None:
    """Add to ``models`` the widening of the disturbance set that is measured in flights with ``equipment``.

    If such a flight diverges or saturates an input, that failure is added to the ``unbounded`` effects instead.
    """
    try:
        widening = plan.remeasured(equipment)
    except DesignError as failure:
        unbounded.append(f"sensors ({failure})")
        return

    def effect(system: ErrorSystem) -> Effect:
        return Effect(np.zeros((*system.A.shape[:2], 0)), np.zeros((len(system.F), 0)), np.zeros(0), widening)

    models["model errors under sensors"] = effect


def declared_actuators(scenario: Scenario) -> str:
    """Return the names of the published actuators in a scenario, separated by commas, or "ideal"."""
    sets = [scenario.settings.get(f"actuator.{channel}.set", IDEAL) for channel in INPUT_NAMES]
    return ",".join(name for name in sets if name != IDEAL) or IDEAL

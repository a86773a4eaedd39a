"""What models of hardware and air add to the disturbance set of a design, and whether it stays certified with them.

Sensors, wind and density add channels to the structured set, bounded as if they could take any value within at every
step; of noise as many standard deviations as :data:`REACH`, which the numbers of :mod:`hsv.noise` pass one time in 370:
their own bound is :data:`hsv.noise.LARGEST`. Errors of a measurement act through the feedback and the notch filter, and
through the scheduling of the nominal model. Actuators add states, and so do samples that come late. The invariant set
is then sought as a design seeks its own, under all vertices, and the nominal plan of the certificate has to fit into
what it leaves of the inputs. Whether limits of actuators act in that set is said by
:mod:`hsv.design.verification.limits`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.estimator_parameters import ESTIMATOR_ENABLED
from hsv.design.disturbance import CHANNELS, DisturbanceSet, widened
from hsv.design.error_system import ErrorSystem
from hsv.design.region import Region, incomplete_share, record
from hsv.design.sets.ellipsoid import ellipsoid
from hsv.design.sets.ellipsoid_set import EllipsoidSet
from hsv.design.sets.invariant_set import TubeProblem
from hsv.design.tightening import left_by
from hsv.design.tube_problem import channel_model, tube_problem
from hsv.design.verification.claims import Subject
from hsv.design.verification.invariant_set import lag_feedback
from hsv.design.verification.limits import Reach, reaches
from hsv.design.verification.plan import Plan
from hsv.errors import DesignError, QuantityError
from hsv.links import command_link, computation, measurement_link
from hsv.lpv.discretisation import zero_order_hold
from hsv.lpv.grid import linearise
from hsv.noise import LARGEST
from hsv.sensors import ALPHA, PITCH, SENSOR_SETS, SensorData, sensor_data
from hsv.simulation.scenario import Scenario
from hsv.units import parse_quantity, to_paper
from hsv.vehicle.actuators import ACTUATOR_PARAMETERS, ACTUATOR_SETS, IDEAL
from hsv.vehicle.atmosphere import atmosphere_data
from hsv.vehicle.dynamics import (
    INPUT_NAMES,
    INPUT_UNITS,
    N_RIGID,
    N_STATES,
    PITCH_RATE,
    STATE_NAMES,
    STATE_UNITS,
    derivative,
)
from hsv.vehicle.trim import trim
from hsv.vehicle.vehicle import Vehicle

Progress = Callable[[str, int, int], None]

REACH = 3.0
"""Standard deviations of noise and turbulence that count as their bound: one sample in 370 is beyond."""

LARGEST_REACH = float(np.ceil(1e3 * LARGEST)) / 1e3
"""Bound of all normal numbers, as it is written: rounded up."""

_WIND_FORWARD, _WIND_UP, _DENSITY = 0, 1, 2
"""Of the conditions that :func:`hsv.vehicle.dynamics.forces_in` takes."""

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
    """What is added to both bounds of the structured set (7)"""
    late: np.ndarray = field(default_factory=lambda: np.zeros(N_RIGID, int))
    """Steps (5) by which each rigid state is seen late"""


Model = Callable[[ErrorSystem], Effect]
"""From the error system that it acts on to the effect of a model."""


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
        """Return the effect on ``system``; what is late of the error e is left to :func:`delayed`."""
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
    """Return what a measurement of the rigid states does (r, n, 5) within a period, by feedback and notch filter."""
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
    """Return air that moves by at most these velocities (m/s) and whose density is off by at most this share.

    Its effect is that at mid-envelope, held over a ``period`` (s).
    """
    bounds = np.array([forward, up, density])

    def effect(system: ErrorSystem) -> Effect:
        point = trim(vehicle.decoupled, *vehicle.centre)
        slopes = np.empty((N_STATES, len(bounds)))
        for column, (index, step) in enumerate(zip((_WIND_FORWARD, _WIND_UP, _DENSITY), _STEP, strict=True)):
            ends = np.empty((2, N_STATES))
            for end, sign in zip(ends, (1.0, -1.0), strict=True):
                conditions = _STILL.copy()
                conditions[index] += sign * step
                derivative(point.state, point.input, vehicle.decoupled, end, conditions)
            slopes[:, column] = (ends[0] - ends[1]) / (2.0 * step)
        A, _ = linearise(vehicle.decoupled, *vehicle.centre)
        rigid = zero_order_hold(A[:N_RIGID, :N_RIGID], slopes[:N_RIGID], period)[1]
        columns = np.zeros((*system.A.shape[:2], len(bounds)))
        columns[:, :N_RIGID] = rigid
        return Effect(columns, np.zeros((len(system.F), len(bounds))), bounds)

    return effect


def with_models(problem: TubeProblem, models: Sequence[Model]) -> TubeProblem:
    """Return ``problem`` with the channels of ``models`` beside its own, but for those that are bounded by zero.

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


@dataclass(frozen=True)
class Verdict:
    """Whether a design is certified with some models: ``half_width`` (5) of the rigid states, ``feedback`` (2), SI.

    ``room`` (2, 2): what the nominal plan leaves of each input, lower and upper side; below zero it does not fit.
    ``reason``: why there is no set at all.
    """

    name: str
    reason: str = ""
    half_width: np.ndarray | None = None
    feedback: np.ndarray | None = None
    room: np.ndarray | None = None
    shares: np.ndarray | None = None
    """The room (2, 2) as a share of the input's range."""
    start: float = 0.0
    """Largest level at which a flight may start: x_n takes errors of the first measurement for the truth"""
    reaches: tuple[Reach, ...] = ()
    """Of the actuators, over the set"""

    @property
    def said(self) -> str:
        """By how much, in words."""
        if self.room is None or self.shares is None:
            return self.reason
        if self.start > 1.0:
            return f"flights may start outside the set, at level {self.start:.3g}"
        input, side = np.unravel_index(int(np.argmin(self.shares)), self.room.shape)
        value, unit = to_paper(abs(float(self.room[input, side])), INPUT_UNITS[input])
        amount = f"{value:.3g}" if unit == "1" else f"{value:.3g} {unit}"
        where = f"{INPUT_NAMES[input]}, {('lower', 'upper')[side]} side"
        return f"room of {amount} ({where})" if self.certified else f"the plan lacks {amount} ({where})"

    @property
    def certified(self) -> bool:
        """Whether the set is found and the plan fits."""
        return self.room is not None and bool(self.room.min() > 0.0) and self.start <= 1.0

    def limited(self) -> Verdict:
        """Return the verdict on the same actuators with their limits: certified where no limit is reached."""
        reason = "; ".join(reach.said for reach in self.reaches)
        inactive = self.certified and all(reach.inactive for reach in self.reaches)
        name = f"{self.name}, limits of actuators"
        return replace(self, name=name, reason=reason) if inactive else Verdict(name, reason or self.said)

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict for JSON."""
        arrays = {name: value.tolist() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        reach = [one.as_dict() for one in self.reaches]
        numbers = {"start_level": self.start, **arrays, "actuators": reach}
        return {"name": self.name, "certified": self.certified, "reason": self.reason, **numbers}


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


def sensors(data: SensorData, plan: Plan, reach: float = REACH, of: str = "sensor") -> dict[str, Model]:
    """Return what sensors of the rigid states do, by name; what is ideal is left out.

    Noise and a Gauss-Markov bias count ``reach`` standard deviations, and so do biases and scales that are drawn once a
    flight; a quantum counts half; what is late is so exactly.
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


def without_bound(data: SensorData, values: Mapping[str, Any]) -> list[str]:
    """Return what of sensors of the rigid states, or of an estimator behind them, no bound is known for."""
    found = {
        "lag of a sensor": data.lag_decay[:N_RIGID].any(),
        "random walk of a sensor": data.walk[:N_RIGID].any(),
        "drop-out of a sensor": data.drop_out[:N_RIGID].any(),
        "range of a sensor": np.isfinite(np.r_[data.minimum[:N_RIGID], data.maximum[:N_RIGID]]).any(),
        "estimator": values.get(ESTIMATOR_ENABLED.name, False),
    }
    return [name for name, there in found.items() if there]


def declared(subject: Subject, scenario: Scenario, reach: float = REACH) -> tuple[dict[str, Model], list[str]]:
    """Return the models of sensors and air that a scenario declares, by name, and what of it has no bound.

    Args:
        subject: The design.
        scenario: Its actuators are for :func:`certified_with`.
        reach: Standard deviations that count as the bound of what is normally distributed.
    """
    values, design = scenario.parameters(), subject.design
    data, moving = sensor_data(values, design.period), atmosphere_data(values, design.period)
    plan = Plan.of(subject)
    models, unbounded = sensors(data, plan, reach), without_bound(data, values)
    if models:
        equipment = {name: value for name, value in values.items() if name.startswith("sensors.") or name == "seed"}
        _remeasure(models, unbounded, plan, equipment)
    vehicle, gusts = subject.vehicle, np.abs(moving.gust).sum(axis=0)
    shear = abs(moving.shear) * max(abs(h - moving.shear_altitude) for h in vehicle.altitude_range)
    winds = {
        "wind": np.abs(moving.wind) + np.array([shear, 0.0]),
        "gusts": gusts if len(moving.gust) else np.zeros(2),
        "turbulence": reach * moving.sigma,
    }
    for name, (forward, up) in winds.items():
        if forward or up:
            models[name] = air(vehicle, design.period, forward, up)
    if density := abs(moving.density_offset) + reach * moving.density_sigma:
        models["density"] = air(vehicle, design.period, density=density)
    return models, [*unbounded, *_beside(values, design.period)]


def _beside(values: Mapping[str, Any], period: float) -> list[str]:
    """Return what of links, and of actuators that are not as published, there is: no model of it is made here."""
    own = [p.name for p in ACTUATOR_PARAMETERS if isinstance(p.default, list) and values.get(p.name)]
    late = not command_link(values, period).ideal or computation(values, period)[1] > 0.0
    found = {"link of the measurement": not measurement_link(values).ideal, "link of the command": late}
    return [*own, *(name for name, there in found.items() if there)]


def _remeasure(models: dict[str, Model], unbounded: list[str], plan: Plan, equipment: Mapping[str, Any]) -> None:
    """Add what flights with sensors leave unexplained, or why there are none that say it."""
    try:
        models["model errors under sensors"] = unexplained(plan, equipment)
    except DesignError as failure:
        unbounded.append(f"sensors ({failure})")


def declared_actuators(scenario: Scenario) -> str:
    """Return the published actuators that a scenario declares, as :func:`certified_with` takes them."""
    sets = [scenario.equipment.get(f"actuator.{channel}.set", IDEAL) for channel in INPUT_NAMES]
    return ",".join(name for name in sets if name != IDEAL)


def described(
    subject: Subject,
    *,
    sensor_set: str = "ideal",
    bias: Sequence[str] = (),
    gust: str = "0 ft/s",
    turbulence: str = "0 ft/s",
    density: str = "0 %",
    reach: float = REACH,
) -> tuple[dict[str, Model], list[str]]:
    """Return the models that are described in words, by name, and what has no bound; what does nothing is left out.

    Args:
        subject: The design.
        sensor_set: A published set.
        bias: Texts "state=quantity" of constant biases of rigid states.
        gust: Largest wind, from below and from behind.
        turbulence: Standard deviation, both ways.
        density: Largest relative difference.
        reach: Standard deviations that count as the bound of what is normally distributed.

    Raises:
        QuantityError: A value that cannot be read or is below zero, or a name that is unknown.
    """
    if sensor_set not in SENSOR_SETS:
        raise QuantityError(f"sensors = {sensor_set!r}: expected one of {', '.join(SENSOR_SETS)}")
    if not 0.0 < reach <= LARGEST_REACH:
        raise QuantityError(f"reach = {reach:g}: expected more than 0, up to {LARGEST_REACH}, beyond which no noise is")
    names = STATE_NAMES[:N_RIGID]
    biases = np.zeros(N_RIGID)
    for text in bias:
        name, _, value = text.partition("=")
        if name.strip() not in names:
            raise QuantityError(f"bias = {text!r}: expected one of {', '.join(names)}, then = and a quantity")
        index = names.index(name.strip())
        biases[index] = abs(parse_quantity(value.strip(), STATE_UNITS[index], f"bias {names[index]}"))
    sizes = {
        "gust": parse_quantity(gust, "m/s", "gust"),
        "turbulence": parse_quantity(turbulence, "m/s", "turbulence"),
        "density": parse_quantity(density, "1", "density"),
    }
    for name, size in sizes.items():
        if size < 0.0:
            raise QuantityError(f"{name} = {size:g}: expected zero or more")
    vehicle, period = subject.vehicle, subject.design.period
    models: dict[str, Model] = {}
    unbounded: list[str] = []
    if sensor_set != "ideal" or biases.any():
        plan, data = Plan.of(subject), sensor_data({"sensors.set": sensor_set}, period)
        models |= sensors(data, plan, reach, f"{sensor_set} sensors:")
        if biases.any():
            models[f"bias of {', '.join(text.strip() for text in bias)}"] = Measured(biases, plan=plan)
        given = {f"sensors.{n}.bias": [float(b)] for n, b in zip(names, biases, strict=True) if b}
        _remeasure(models, unbounded, plan, {"sensors.set": sensor_set, **given})
    if sizes["gust"]:
        models[f"gust {gust}"] = air(vehicle, period, sizes["gust"], sizes["gust"])
    if sizes["turbulence"]:
        bound = reach * sizes["turbulence"]
        models[f"turbulence {turbulence}"] = air(vehicle, period, bound, bound)
    if sizes["density"]:
        models[f"density {density}"] = air(vehicle, period, density=sizes["density"])
    return models, unbounded


def certified_with(
    subject: Subject,
    models: Mapping[str, Model],
    actuators: str = "",
    progress: Progress = lambda *_: None,
    unbounded: Sequence[str] = (),
) -> list[Verdict]:
    """Return a verdict for the design as it is, with its ``actuators``, with each model alone, and with all.

    Where actuators are known and all is certified without their limits, a last verdict is on these.

    Args:
        subject: The design with its certificate.
        models: By name.
        actuators: Names with commas between; none: those that the design knows.
        progress: Told of every verdict.
        unbounded: What else there is, for which no bound is known: with that nothing is certified.

    Raises:
        DesignError: Unknown actuators, two of one channel, or a design without an ellipsoid.
    """
    design, tube = subject.design, subject.certificate["tube"]
    if tube["invariant_set"]["kind"] != EllipsoidSet.kind:
        raise DesignError(
            f"design {design.name!r}: set of kind {tube['invariant_set']['kind']!r}, expected an ellipsoid"
        )
    names = tuple(name.strip() for name in actuators.split(",")) if actuators else design.actuators
    for name in names:
        if name not in ACTUATOR_SETS:
            raise DesignError(f"actuators = {actuators!r}: expected names from {', '.join(ACTUATOR_SETS)}")
    if len({ACTUATOR_SETS[name].channel for name in names}) < len(names):
        raise DesignError(f"actuators = {actuators!r}: expected at most one a channel")
    behind = replace(design, actuators=names)
    lag = lag_feedback(tube["tightening"])
    if names != design.actuators:
        lag = _lag_of_the_plan(subject, behind)
    cases: list[tuple[str, ControlDesign, list[Model]]] = [("as certified", design, [])]
    if names != design.actuators:
        cases.append((f"actuators {', '.join(names)}", behind, []))
    cases += [(name, behind, [model]) for name, model in models.items()]
    if len(cases) > 2:
        cases.append(("all", behind, list(models.values())))
    verdicts = []
    for done, (name, flown, added) in enumerate(cases):
        progress("invariant sets", done, len(cases))
        bounds = lag if flown.actuators else None
        verdicts.append(verdict(name, flown, subject, added, bounds))
    progress("invariant sets", len(cases), len(cases))
    if verdicts[-1].reaches:
        verdicts.append(verdicts[-1].limited())
    return [*verdicts, *(Verdict(name, "no bound is known for its effect") for name in unbounded)]


def _lag_of_the_plan(subject: Subject, design: ControlDesign) -> tuple[np.ndarray, np.ndarray]:
    """Return least and largest feedback (2 each) to the lag of the nominal vehicle's plan, inflated as a design's."""
    inputs = subject.inputs
    flight = Region(subject.design, inputs, incomplete_share(inputs)).fly({})
    feedback = channel_model(design, subject.vehicle).errors(record(flight))[1]
    return widened(feedback.min(axis=0), feedback.max(axis=0), inputs.disturbance.inflation)


def verdict(
    name: str,
    design: ControlDesign,
    subject: Subject,
    models: Sequence[Model] = (),
    lag: tuple[np.ndarray, np.ndarray] | None = None,
) -> Verdict:
    """Return whether ``design`` is certified with ``models`` beside the disturbances of its certificate.

    Args:
        name: Of the verdict.
        design: That of ``subject``, with the actuators that are to be known.
        subject: The design with its certificate.
        models: Beside those disturbances.
        lag: Least and largest feedback (2 each) to the lag of the plan.
    """
    tube, inputs = subject.certificate["tube"], subject.inputs.invariant_set
    disturbance = DisturbanceSet.from_report(tube["disturbance"]["channels"])
    problem = with_models(tube_problem(design, subject.vehicle, disturbance), models)
    own = tube["invariant_set"]["contraction"]
    others = [value for value in inputs.contraction if value != own]
    measured = [model for model in models if isinstance(model, Measured)]
    error = np.sum([model.error for model in measured] or [np.zeros(N_RIGID)], axis=0)
    late = np.sum([model.late for model in measured] or [np.zeros(N_RIGID)], axis=0) > 0.0
    best = Verdict(name, "no contraction to try")
    for contractions in ([own], others):
        # Seldom is another contraction better than the certificate's by much: they are tried where it does not do.
        if not best.certified and contractions:
            found = _with_contractions(name, design, subject, problem, contractions, lag, error, late)
            best = max(found, best, key=lambda one: -np.inf if one.shares is None else float(one.shares.min()))
    return best


def _with_contractions(
    name: str,
    design: ControlDesign,
    subject: Subject,
    problem: TubeProblem,
    contractions: list[float],
    lag: tuple[np.ndarray, np.ndarray] | None,
    error: np.ndarray,
    late: np.ndarray,
) -> Verdict:
    inputs, plan = subject.inputs.invariant_set, subject.certificate["tube"]["tightening"]["plan"]
    try:
        found = ellipsoid(problem, inputs.state_scale.array(), inputs.input_scale.array(), contractions)
    except DesignError as failure:
        return Verdict(name, str(failure))
    scheduling = late & (np.arange(N_RIGID) < N_SCHEDULING)
    if np.any(found.half_width[:N_RIGID][scheduling] > Plan.of(subject).half_width[scheduling]):
        # Measured took them to be as far from the truth as the design's own set is wide.
        return Verdict(name, "the set is wider than late samples of altitude and velocity were bounded by")
    bounds = left_by(found, design.input_minimum, design.input_maximum, lag)
    room = bounds.margins(np.array(plan["lowest"]), np.array(plan["highest"]))
    limits = design.input_maximum - design.input_minimum
    feedback = 0.5 * (limits - bounds.upper + bounds.lower)
    reach = tuple(reaches(found, design, Plan.of(subject))) if design.actuators else ()
    start = _start(found, error)
    return Verdict(name, "", found.half_width[:N_RIGID], feedback, room, room / limits[:, None], start, reach)


def _start(found: EllipsoidSet, error: np.ndarray) -> float:
    """Return the largest level of the error with which a flight starts that is measured with an ``error`` (5)."""
    corners = np.array(list(product((-1.0, 1.0), repeat=N_RIGID))) * error
    return float(found.level(np.pad(corners, ((0, 0), (0, len(found.centre) - N_RIGID)))).max())

"""What models of hardware and air add to the disturbance set of a design, and whether it stays certified with them.

Sensors, wind and density add channels to the structured set, bounded as if they could take any value within at every
step; of noise, which has no bound, as many standard deviations as :data:`REACH`. Actuators add states. The invariant
set is then sought as a design seeks its own, under all vertices, and the nominal plan of the certificate has to fit
into what it leaves of the inputs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.design.disturbance import DisturbanceSet, widened
from hsv.design.error_system import ErrorSystem
from hsv.design.region import Region, incomplete_share, record
from hsv.design.sets.ellipsoid import ellipsoid
from hsv.design.sets.ellipsoid_set import EllipsoidSet
from hsv.design.sets.invariant_set import TubeProblem
from hsv.design.tightening import left_by
from hsv.design.tube_problem import channel_model, tube_problem
from hsv.design.verification.claims import Subject
from hsv.design.verification.invariant_set import lag_feedback
from hsv.errors import DesignError, QuantityError
from hsv.lpv.discretisation import zero_order_hold
from hsv.lpv.grid import linearise
from hsv.sensors import SENSOR_SETS
from hsv.units import parse_quantity, to_paper
from hsv.vehicle.actuators import ACTUATOR_SETS
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

_WIND_FORWARD, _WIND_UP, _DENSITY = 0, 1, 2
"""Of the conditions that :func:`hsv.vehicle.dynamics.forces_in` takes."""

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


Model = Callable[[ErrorSystem], Effect]
"""From the error system that it acts on to the effect of a model."""


def measured(noise: np.ndarray, bias: np.ndarray) -> Model:
    """Return sensors of the rigid states with white ``noise`` (5 standard deviations) and ``bias`` (5), SI."""

    def effect(system: ErrorSystem) -> Effect:
        seen = system.F[:, :N_RIGID]
        columns = system.B @ seen
        filtered = np.array([name.startswith("filter_") for name in system.names])
        columns[:, filtered, PITCH_RATE] += system.A[:, filtered, PITCH_RATE]
        return Effect(columns, seen, np.abs(bias) + REACH * noise)

    return effect


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
    """Return ``problem`` with the channels of ``models`` beside its own, but for those that are bounded by zero."""
    system, disturbance = problem.system, problem.disturbance
    for model in models:
        added = model(problem.system)
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
    return TubeProblem(system, disturbance)


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

    @property
    def said(self) -> str:
        """By how much, in words."""
        if self.room is None or self.shares is None:
            return self.reason
        input, side = np.unravel_index(int(np.argmin(self.shares)), self.room.shape)
        value, unit = to_paper(abs(float(self.room[input, side])), INPUT_UNITS[input])
        amount = f"{value:.3g}" if unit == "1" else f"{value:.3g} {unit}"
        where = f"{INPUT_NAMES[input]}, {('lower', 'upper')[side]} side"
        return f"room of {amount} ({where})" if self.certified else f"the plan lacks {amount} ({where})"

    @property
    def certified(self) -> bool:
        """Whether the set is found and the plan fits."""
        return self.room is not None and bool(self.room.min() > 0.0)

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict for JSON."""
        arrays = {name: value.tolist() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return {"name": self.name, "certified": self.certified, "reason": self.reason, **arrays}


def described(
    subject: Subject,
    *,
    sensors: str = "ideal",
    bias: Sequence[str] = (),
    gust: str = "0 ft/s",
    turbulence: str = "0 ft/s",
    density: str = "0 %",
) -> dict[str, Model]:
    """Return the models that are described in words, by name; those that do nothing are left out.

    Args:
        subject: The design.
        sensors: A published set, of which noise and bias count.
        bias: Texts "state=quantity" of constant biases of rigid states.
        gust: Largest wind, from below and from behind.
        turbulence: Standard deviation, both ways.
        density: Largest relative difference.

    Raises:
        QuantityError: A value that cannot be read or is below zero, or a name that is unknown.
    """
    if sensors not in SENSOR_SETS:
        raise QuantityError(f"sensors = {sensors!r}: expected one of {', '.join(SENSOR_SETS)}")
    names = STATE_NAMES[:N_RIGID]
    given = SENSOR_SETS[sensors].channels
    noise, offset = np.zeros(N_RIGID), np.zeros(N_RIGID)
    for index, name in enumerate(names):
        fields = given.get(name, {})
        noise[index] = np.linalg.norm([fields.get(kind, 0.0) for kind in ("noise", "bias_sigma", "drift_sigma")])
        offset[index] = fields.get("bias", 0.0)
    biases = np.zeros(N_RIGID)
    for text in bias:
        name, _, value = text.partition("=")
        if name.strip() not in names:
            raise QuantityError(f"bias = {text!r}: expected one of {', '.join(names)}, then = and a quantity")
        index = names.index(name.strip())
        biases[index] = parse_quantity(value.strip(), STATE_UNITS[index], f"bias {names[index]}")
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
    if noise.any() or offset.any():
        models[f"sensors {sensors}"] = measured(noise, offset)
    if biases.any():
        models[f"bias of {', '.join(text.strip() for text in bias)}"] = measured(np.zeros(N_RIGID), biases)
    if sizes["gust"]:
        models[f"gust {gust}"] = air(vehicle, period, sizes["gust"], sizes["gust"])
    if sizes["turbulence"]:
        bound = REACH * sizes["turbulence"]
        models[f"turbulence {turbulence}"] = air(vehicle, period, bound, bound)
    if sizes["density"]:
        models[f"density {density}"] = air(vehicle, period, density=sizes["density"])
    return models


def certified_with(
    subject: Subject, models: Mapping[str, Model], actuators: str = "", progress: Progress = lambda *_: None
) -> list[Verdict]:
    """Return a verdict for the design as it is, with its ``actuators``, with each model alone, and with all.

    Args:
        subject: The design with its certificate.
        models: By name.
        actuators: Names with commas between; none: those that the design knows.
        progress: Told of every verdict.

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
    return verdicts


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
    best = Verdict(name, "no contraction to try")
    for contractions in ([own], others):
        # Seldom is another contraction better than the certificate's by much: they are tried where it does not do.
        if not best.certified and contractions:
            found = _with_contractions(name, design, subject, problem, contractions, lag)
            best = max(best, found, key=lambda one: -np.inf if one.shares is None else float(one.shares.min()))
    return best


def _with_contractions(
    name: str,
    design: ControlDesign,
    subject: Subject,
    problem: TubeProblem,
    contractions: list[float],
    lag: tuple[np.ndarray, np.ndarray] | None,
) -> Verdict:
    inputs, plan = subject.inputs.invariant_set, subject.certificate["tube"]["tightening"]["plan"]
    try:
        found = ellipsoid(problem, inputs.state_scale.array(), inputs.input_scale.array(), contractions)
    except DesignError as error:
        return Verdict(name, str(error))
    bounds = left_by(found, design.input_minimum, design.input_maximum, lag)
    room = bounds.margins(np.array(plan["lowest"]), np.array(plan["highest"]))
    limits = design.input_maximum - design.input_minimum
    feedback = 0.5 * (limits - bounds.upper + bounds.lower)
    return Verdict(name, "", found.half_width[:N_RIGID], feedback, room, room / limits[:, None])

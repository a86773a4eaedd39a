"""Verdict: whether a design remains certified with models of hardware and air in addition to its disturbances.

Actuators add states. The invariant set is computed as in the design, for all vertices, and the nominal plan of the
certificate must fit into the inputs tightened by it. The error system is linear: it ignores stops and rate limits of
actuators. If no error in the set takes an actuator beyond them, the result also holds with these limits. Otherwise it
holds only for the same actuators without limits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.base.units import UnitSystem, in_system, quantity_text
from hsv.control.design import ControlDesign
from hsv.design.certified import CertifiedDesign, Plan
from hsv.design.disturbance import widened
from hsv.design.hardware.models import N_SCHEDULING, Measured, Model, with_models
from hsv.design.region import Region, incomplete_share
from hsv.design.sets.invariant_set import InvariantSet
from hsv.design.tightening import left_by
from hsv.design.tube import invariant_set
from hsv.design.tube_problem import tube_problem
from hsv.flight.disturbance import ChannelModel
from hsv.model.actuators import ACTUATOR_SETS, IDEAL, SUBSTEPS
from hsv.model.lpv.actuated import actuator_names, actuator_system
from hsv.model.lpv.linearisation import zero_order_hold
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_RIGID
from hsv.model.trim import trim

Lag = tuple[np.ndarray, np.ndarray] | None
"""Minimum and maximum, shape (2,) each, of the feedback due to the actuators' lag; None: ideal actuators."""


@dataclass(frozen=True)
class Reach:
    """Range of one actuator over the invariant set: positions ``lowest`` to ``highest``, rates up to ``rate``, SI.

    ``stop`` and ``rate_limit``: largest permitted magnitudes of position and rate; infinite: no limit.
    """

    channel: str
    lowest: float
    highest: float
    rate: float
    stop: float
    rate_limit: float

    @property
    def inactive(self) -> bool:
        """Whether the actuator stays within its limits."""
        return max(-self.lowest, self.highest) <= self.stop and self.rate <= self.rate_limit

    def said(self, units: UnitSystem = UnitSystem.metric) -> str:
        """Return largest position and rate, compared with their limits, in words."""
        unit = INPUT_UNITS[INPUT_NAMES.index(self.channel)]
        words = []
        for what, value, limit, of in (
            ("position", max(-self.lowest, self.highest), self.stop, unit),
            ("rate", self.rate, self.rate_limit, "1/s" if unit == "1" else f"{unit}/s"),
        ):
            number, shown = in_system(value, of, units)
            named = "" if shown == "1" else f" {shown}"
            if np.isfinite(limit):
                bound = in_system(limit, of, units)[0]
                side = f"inactive by {bound - number:.3g}" if number <= bound else f"beyond it by {number - bound:.3g}"
                words.append(f"{what} up to {number:.3g} of {bound:.3g}{named}, {side}")
            else:
                words.append(f"{what} up to {number:.3g}{named}, no limit")
        return f"{self.channel}: {'; '.join(words)}"

    def as_dict(self) -> dict[str, Any]:
        """Return the range for JSON; an infinite limit is ``None``."""
        numbers = {name: None if value == np.inf else value for name, value in vars(self).items()}
        return numbers | {"inactive": self.inactive}


@dataclass(frozen=True)
class Verdict:
    """Verdict on a design with models of hardware and air: its invariant set, and the margins of the plan, SI.

    ``half_width``: of the rigid states; ``feedback``: half-range by input. ``room[i]``: margins of the plan to the
    lower and upper tightened bound of input i; it fits if they are positive. ``reason``: why ``room`` is None; for a
    verdict on limits of actuators, the text of :meth:`said`.
    """

    name: str
    reason: str = ""
    half_width: np.ndarray | None = None
    feedback: np.ndarray | None = None
    room: np.ndarray | None = None
    shares: np.ndarray | None = None
    """The margins ``room`` as shares of the range of each input."""
    start: float = 0.0
    """Bound on the start level of the tube error: x_n starts at the first measurement, whose errors remain in e."""
    reaches: tuple[Reach, ...] = ()
    """Ranges of the actuators over the invariant set."""
    without_limits: Verdict | None = None
    """For a verdict on the limits of actuators: the verdict that ignores the limits. Otherwise None."""

    def said(self, units: UnitSystem = UnitSystem.metric) -> str:
        """Return the smallest margin, or why there is no certificate, in words; for limits: the actuators' ranges."""
        if self.without_limits:
            return "; ".join(reach.said(units) for reach in self.reaches) or self.without_limits.said(units)
        if self.room is None or self.shares is None:
            return self.reason
        if self.start > 1.0:
            return f"flights may start outside the set, at level {self.start:.3g}"
        input, side = np.unravel_index(int(np.argmin(self.shares)), self.room.shape)
        amount = quantity_text(abs(float(self.room[input, side])), INPUT_UNITS[input], units)
        where = f"{INPUT_NAMES[input]}, {('lower', 'upper')[side]} side"
        return f"room of {amount} ({where})" if self.certified else f"the plan lacks {amount} ({where})"

    @property
    def certified(self) -> bool:
        """Whether there is an invariant set in which all flights start, and the plan fits into the tightened bounds."""
        return self.room is not None and bool(self.room.min() > 0.0) and self.start <= 1.0

    def limited(self) -> Verdict:
        """Return the verdict on the actuators with limits: certified if this verdict is and no limit is exceeded."""
        limited = replace(self, name=f"{self.name}, limits of actuators", without_limits=self)
        if not (self.certified and all(reach.inactive for reach in self.reaches)):
            limited = replace(limited, half_width=None, feedback=None, room=None, shares=None)
        return replace(limited, reason=limited.said(UnitSystem.si))

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict for JSON."""
        arrays = {name: value.tolist() for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        reach = [one.as_dict() for one in self.reaches]
        numbers = {"start_level": self.start, **arrays, "actuators": reach}
        return {"name": self.name, "certified": self.certified, "reason": self.reason, **numbers}


def certified_with(
    subject: CertifiedDesign,
    models: Mapping[str, Model],
    actuators: str = "",
    progress: Progress = lambda *_: None,
    unbounded: Sequence[str] = (),
) -> list[Verdict]:
    """Return the verdicts: as certified, with other ``actuators``, with each of the ``models``, and with all of them.

    Verdicts that would repeat another are omitted; those on models include the actuators. If the last one has actuators
    and an invariant set, a verdict on the limits of the actuators follows.

    Args:
        subject: The design with its certificate.
        models: Models by name.
        actuators: Names, separated by commas, or "ideal"; empty: the actuators of the design.
        progress: Called with the name of the stage, the number of verdicts that are done, and their total number.
        unbounded: Names of effects without a known bound; for each of them, a negative verdict is added.

    Raises:
        DesignError: Unknown actuators, or two for the same channel.
    """
    design = subject.design
    names = _named(actuators) if actuators else design.actuators
    lag = subject.lag_feedback
    cases: list[tuple[str, ControlDesign, list[Model], Lag]] = [("as certified", design, [], lag)]
    behind = design
    if set(names) != set(design.actuators):
        behind = replace(design, actuators=names)
        lag = _lag_of_the_plan(subject, behind) if names else None
        cases.append((f"actuators {', '.join(names)}" if names else "ideal actuators", behind, [], lag))
    cases += [(name, behind, [model], lag) for name, model in models.items()]
    if len(models) > 1:
        cases.append(("all", behind, list(models.values()), lag))
    verdicts = []
    for done, (name, flown, added, bounds) in enumerate(cases):
        progress("invariant sets", done, len(cases))
        verdicts.append(verdict(name, flown, subject, added, bounds))
    progress("invariant sets", len(cases), len(cases))
    if verdicts[-1].reaches:
        verdicts.append(verdicts[-1].limited())
    return [*verdicts, *(Verdict(name, "no bound is known for its effect") for name in unbounded)]


def _named(actuators: str) -> tuple[str, ...]:
    """Return the names in the text ``actuators``, separated by commas; for "ideal", an empty tuple.

    Raises:
        DesignError: Unknown actuators, or two for the same channel.
    """
    if actuators.strip() == IDEAL:
        return ()
    names = tuple(name.strip() for name in actuators.split(","))
    for name in names:
        if name not in ACTUATOR_SETS:
            raise DesignError(f"actuators = {actuators!r}: expected {IDEAL}, or names from {', '.join(ACTUATOR_SETS)}")
    if len({ACTUATOR_SETS[name].channel for name in names}) < len(names):
        raise DesignError(f"actuators = {actuators!r}: expected at most one a channel")
    return names


def _lag_of_the_plan(subject: CertifiedDesign, design: ControlDesign) -> tuple[np.ndarray, np.ndarray]:
    """Return minimum and maximum, shape (2,) each, of the feedback due to the actuators' lag, inflated like W.

    The actuators are those of ``design``, the plan that of the nominal vehicle of ``subject``.
    """
    inputs = subject.inputs
    flight = Region(subject.design, inputs, incomplete_share(inputs)).fly({})
    feedback = ChannelModel(design, subject.vehicle).lag(flight)[1]
    return widened(feedback.min(axis=0), feedback.max(axis=0), inputs.disturbance.inflation)


def verdict(
    name: str, design: ControlDesign, subject: CertifiedDesign, models: Sequence[Model] = (), lag: Lag = None
) -> Verdict:
    """Return the verdict on whether ``design`` remains certified with ``models`` of hardware and air.

    Args:
        name: Name of the verdict.
        design: Design of ``subject``, with the actuators to certify.
        subject: The design with its certificate.
        models: Models in addition to the certified disturbances.
        lag: Feedback due to the actuators' lag behind the plan.
    """
    tube, inputs = subject.certificate["tube"], subject.inputs.invariant_set
    problem = with_models(tube_problem(design, subject.vehicle, subject.disturbance), models)
    lowest, highest = (np.array(tube["tightening"]["plan"][name])[:N_INPUTS] for name in ("lowest", "highest"))
    measured = [model for model in models if isinstance(model, Measured)]
    error = sum((model.error for model in measured), np.zeros(N_RIGID))
    late = sum((model.late for model in measured), np.zeros(N_RIGID, int))[:N_SCHEDULING] > 0

    def judged(contractions: list[float]) -> Verdict:
        try:
            found = invariant_set(problem, inputs.model_copy(update={"contraction": contractions}))
        except DesignError as failure:
            return Verdict(name, str(failure))
        half_width = found.half_width[:N_RIGID]
        if late.any() and np.any((half_width > Plan.of(subject).half_width)[:N_SCHEDULING][late]):
            # Measured bounds the error of late samples by the half-widths of the design's own set.
            return Verdict(name, "the set is wider than late samples of altitude and velocity were bounded by")
        bounds = left_by(found, design.input_minimum, design.input_maximum, lag)
        limits = design.input_maximum - design.input_minimum
        room, feedback = bounds.margins(lowest, highest), 0.5 * (limits - bounds.upper + bounds.lower)
        reach = tuple(reaches(found, design, Plan.of(subject))) if design.actuators else ()
        return Verdict(name, "", half_width, feedback, room, room / limits[:, None], _start(found, error), reach)

    own = tube["invariant_set"]["contraction"]
    best = judged([own])
    # Other contractions are seldom much better than that of the certificate; they are tried only if it fails.
    others = [value for value in inputs.contraction if value != own]
    if best.certified or not others:
        return best
    return max(judged(others), best, key=lambda one: -np.inf if one.shares is None else float(one.shares.min()))


def _start(found: InvariantSet, error: np.ndarray) -> float:
    """Return a bound on the start level of a flight for errors up to ``error``, shape (5,), in the measurement."""
    corners = np.array(list(product((-1.0, 1.0), repeat=N_RIGID))) * error
    errors = np.pad(corners, ((0, 0), (0, len(found.centre) - N_RIGID)))
    level = float(found.levels(errors).max())
    if found.star_norms is None:
        return level
    return max(level, *(found.star_norms.level_at_start(found.problem, found.centre, error) for error in errors))


def reaches(found: InvariantSet, design: ControlDesign, plan: Plan) -> list[Reach]:
    """Return the position and rate ranges of the actuators of ``design`` over all errors in the ellipsoid of ``found``.

    The ellipsoid is about the ``plan``; star norms are ignored, and all disturbances within their bounds are included.
    Positions and rates are evaluated at every substep, where the limits act.
    """
    system, disturbance, known = found.problem.system, found.problem.disturbance, design.actuator_sets
    flown, commands = plan.actuators(design)
    states = [system.names.index(name) for name in actuator_names(known)]
    A, B, C, _ = actuator_system(known)
    ends: list[list[np.ndarray]] = [[], []]
    for substep in range(1, SUBSTEPS + 1):
        held, entering = zero_order_hold(A, B, substep * design.period / SUBSTEPS)
        # Positions, then rates, from the actuators' states and from the command.
        maps = (C @ held, C @ entering), (C @ A @ held, C @ (A @ entering + B))
        for (on_a, on_u), end in zip(maps, ends, strict=True):
            planned = flown @ on_a.T + commands @ on_u.T
            on_e, on_d = on_u @ system.F, on_u @ system.F_d
            on_e[:, states] += on_a
            on_d[:, 3] += on_u[:, 1]  # the lost elevator acts like a command
            middle = on_e @ found.centre + on_d @ disturbance.centre
            half = np.sqrt(np.sum((on_e @ found.Q) * on_e, axis=1)) + np.abs(on_d) @ disturbance.half_width
            end.append(plan.inflation * np.minimum(planned.min(axis=0), 0.0) + middle - half)
            end.append(plan.inflation * np.maximum(planned.max(axis=0), 0.0) + middle + half)
    at_rest = trim(plan.subject.vehicle.decoupled, *plan.flight.history.state[0, :2]).input
    low, high = (of(ends[0], axis=0) + at_rest for of in (np.min, np.max))
    rate = np.max(np.abs(ends[1]), axis=0)
    result = []
    for a in known:
        i = INPUT_NAMES.index(a.channel)
        result.append(Reach(a.channel, float(low[i]), float(high[i]), float(rate[i]), a.stop, a.rate_limit))
    return result

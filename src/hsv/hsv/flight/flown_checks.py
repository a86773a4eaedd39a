"""Verification of a design by flights and random sequences; :mod:`hsv.certificate.verification` has the other checks.

Nothing here uses the code that computes designs. The core simulates the flights, and :mod:`hsv.flight.disturbance`
takes their disturbances apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.certificate.checks import (
    Check,
    Checks,
    Subject,
    above,
    at_most,
    equal,
    field_checks,
    gathered,
    recomputed,
    under,
)
from hsv.certificate.coverage import region_parameters
from hsv.certificate.margin_checks import margin_checks
from hsv.certificate.tolerances import ROUNDING, TOLERANCES
from hsv.certificate.verification import (
    FLOWN_FIELDS,
    QUICK,
    RECOMPUTED,
    Part,
    Tube,
    ellipsoid_levels,
    inflated_bounds,
    lag_feedback,
)
from hsv.control.design import ControlDesign
from hsv.flight.assembly import assemble_flight, assemble_with
from hsv.flight.closed_loop import Components, fly
from hsv.flight.corners import Corner, Drawn, corners, drawn_flights, fraction
from hsv.flight.disturbance import ChannelModel, membership, plan_extremes
from hsv.flight.flight import Flight
from hsv.flight.random_sequences import random_sequences
from hsv.flight.scenario import Scenario
from hsv.flight.side_by_side import fly_each, fly_perturbed
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.schedule import ScheduledFault
from hsv.model.faults.table import Fault
from hsv.model.plant import FlightStatus
from hsv.model.signals import (
    INPUT_NAMES,
    N_RIGID,
    STATE_NAMES,
)

DRAWN = 192
"""Number of flights that are drawn from a design's region by default."""

OUTPUTS = (*STATE_NAMES[:N_RIGID], *(f"feedback {name}" for name in INPUT_NAMES))
"""Names of the outputs of a tube, :attr:`Tube.rows`."""

SEQUENCES, STEPS = 20_000, 600
"""Number of random sequences of vertices and disturbances, and their steps."""


def region(subject: Subject, design: ControlDesign, share: float) -> Components:
    """Return the components for the flight that the design declares, with ``share`` of its fault (eq. 47)."""
    declared = region_parameters(subject.certificate["inputs"], subject.vehicle, share)
    return assemble_with(design, declared)


@dataclass(frozen=True)
class Evidence:
    """Extremes of a flight: largest ``level`` in the tube, and largest ``ratio`` of a disturbance to its bound.

    The largest ratio occurs in ``channel`` at ``step``. ``lowest`` and ``highest``, shape (3,), are the extremes of the
    two inputs u_r + u_n and of the nominal pitch acceleration (rad/s^2). ``lag``, shape (2, 2), and ``channels``, shape
    (2, 7), have minima (row 0) and maxima (row 1) of the feedback due to the actuators' lag, and of the disturbances.
    ``moved``, shape (2,), is the largest change of altitude (m) and velocity (m/s) in a step. ``outputs``, shape (7,),
    are the largest distances of the errors and of the feedback (:attr:`Tube.rows`) from the centre of the set.
    """

    level: float
    ratio: float
    channel: str
    step: int
    lowest: np.ndarray
    highest: np.ndarray
    lag: np.ndarray
    channels: np.ndarray
    moved: np.ndarray
    outputs: np.ndarray


def evidence(model: ChannelModel, tube: Tube, flight: Flight) -> Evidence:
    """Return the extremes of ``flight`` that are compared with the ``tube``.

    Raises:
        DesignError: The flight diverged, or an input was limited.
    """
    h = flight.history
    if flight.status is not FlightStatus.FINISHED or np.any(h.command != h.u_unsaturated):
        raise DesignError(f"flight: {flight.status.name}, expected FINISHED, no input limited")
    channels, (error, lag) = model.channels(flight), model.errors(flight)
    v, bound = error - tube.c, membership(channels, tube.lower, tube.upper)
    return Evidence(
        float(ellipsoid_levels(tube.Q, v).max()),
        *bound,
        *plan_extremes(flight),
        np.stack((lag.min(axis=0), lag.max(axis=0))),
        np.stack((channels.min(axis=0), channels.max(axis=0))),
        np.abs(np.diff(h.state[:, :2], axis=0)).max(axis=0),
        np.abs(v @ tube.rows.T).max(axis=0),
    )


def share_of(inputs: Mapping[str, Any]) -> float:
    """Return the share of fault and parameter bounds that W' covers (eq. 47): largest tau, 1 if tau is fixed."""
    return float(max(inputs["adjustable"]["tau"])) if inputs.get("adjustable") else 1.0


def flight_checks(subject: Subject, seed: int, number: int = DRAWN) -> Checks:
    """Yield the checks of the flights over which W was measured (eq. 19), and of ``number`` drawn with a ``seed``.

    Errors must stay in the set (eq. 26), and plans u_r + u_n in the stated range, which is within the bounds of eq. 30.
    The check of the pitch acceleration is our own. If the certificate is for a share of W, every flight may leave it.
    """
    subject = replace(subject, design=replace(subject.design, tau=subject.design.tau_minimum))  # in flight: any tau
    inputs, vehicle, tube = subject.certificate["inputs"], subject.vehicle, Tube(subject, subject.design, "tube")
    share, declared, model = share_of(inputs), inputs["disturbance"], ChannelModel(subject.design, vehicle)
    parts, seen = region(subject, subject.design, share), fraction(vehicle.uncertainty, share)
    everyone = corners(vehicle.uncertainty, share)
    yield from _statements(subject, len(seen), len(everyone), parts)

    def show(_: object, flight: Flight) -> Evidence:
        return evidence(model, tube, flight)

    stated, plan = subject.stated("tube.flights"), subject.stated("tube.tightening.plan")
    sides = [*plan["lowest_flight"], *plan["highest_flight"]]
    pinned = sorted({stated["worst_level_flight"], stated["worst_ratio_flight"], *sides})
    measured = fly_perturbed(parts, seen, show)
    again = dict(zip(pinned, fly_perturbed(parts, [everyone[i] for i in pinned], show), strict=True))
    yield from _measured(subject, measured)
    worst, largest = again[stated["worst_level_flight"]], again[stated["worst_ratio_flight"]]
    field = "tube.flights"
    yield _pinned(subject, f"{field}.worst_level", worst.level)
    check = _pinned(subject, f"{field}.worst_ratio", largest.ratio)
    yield replace(check, fields=(*check.fields, f"{field}.channel", f"{field}.step"))
    place, found = (stated["channel"], stated["step"]), (largest.channel, largest.step)
    yield Check(f"{field}.channel, {field}.step", str(place), str(found), place == found)
    for side in ("lowest", "highest"):
        extremes = [getattr(again[f], side)[i] for i, f in enumerate(plan[f"{side}_flight"])]
        check = recomputed(subject, f"tube.tightening.plan.{side}", extremes, "flights")
        yield replace(check, fields=(*check.fields, f"{check.fields[0]}_flight"))

    def build(drawn: Drawn) -> Components:
        lost = Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": drawn.effectiveness})
        injector = FaultInjector([ScheduledFault(lost, drawn.start)], subject.design.period)
        return replace(parts.perturbed(drawn.corner), fault_injector=injector)

    drawn = drawn_flights(inputs, vehicle, share, number, seed)
    flown = [*measured, *again.values(), *fly_each(drawn, build, show)]
    allowance = 1.0 + TOLERANCES["flights"].relative
    own = [*measured, *again.values()]
    yield at_most("flights of the region: level", max(f.level for f in own), stated["worst_level"] * allowance)
    yield at_most("flights of the region: ratio to W", max(f.ratio for f in own), stated["worst_ratio"] * allowance)
    yield at_most(f"{number} drawn flights: level", max(f.level for f in flown), 1.0)
    yield at_most(f"{number} drawn flights: ratio to W", declared["share"] * max(f.ratio for f in flown), 1.0)
    outputs, certified = np.max([f.outputs for f in flown], axis=0), tube.certified
    for name, reached, bound in zip(OUTPUTS, outputs, certified, strict=True):
        yield at_most(f"{number} drawn flights: {name}", reached, bound)
    if declared["share"] < 1.0:  # every flight counts
        own = fly_perturbed(parts, everyone, show)
    yield recomputed(subject, f"{field}.outside", sum(f.ratio > 1.0 for f in own), "copied")
    low, high = (np.array([getattr(f, side) for f in own]) for side in ("lowest", "highest"))
    yield above("flights of the region: lowest of plans", float((low - plan["lowest"]).min()), -ROUNDING)
    yield above("flights of the region: highest of plans", float((plan["highest"] - high).min()), -ROUNDING)
    bounds = subject.stated("tube.tightening")
    yield above(f"{number} drawn flights: room of plans in U minus F Z", plan_room(bounds, flown), 0.0)
    yield _lag_check("feedback to the lag of the plan", subject, flown)
    yield from _rate_checks("all flights", subject, flown)
    if "adjustable" in subject.certificate:
        # Our own check: with the whole fault (W), too, these flights stay in the set for W' (eq. 47), beyond eq. 26.
        field, everyone = "adjustable.complete_fault", corners(vehicle.uncertainty, 1.0)
        yield recomputed(subject, f"{field}.flights", len(everyone), "copied")
        first = subject.stated(f"{field}.worst_level_flight")
        some = [everyone[i] for i in (first, *np.random.default_rng(seed).choice(len(everyone), 48))]
        worst, *others = fly_perturbed(region(subject, subject.design, 1.0), some, show)
        yield _pinned(subject, f"{field}.worst_level", worst.level)
        limit = min(1.0, subject.stated(f"{field}.worst_level") * allowance)
        yield at_most(f"{field}: level", max(f.level for f in others), limit)


def _statements(subject: Subject, seen: int, everyone: int, parts: Components) -> Checks:
    """Yield the checks of counts, and of the nominal flight of the region, whose bits are the same on every machine."""
    declared = subject.stated("inputs.disturbance")
    yield recomputed(subject, "tube.disturbance.flights", seen, "copied")
    yield recomputed(subject, "tube.flights.flights", everyone, "copied")
    steps = round(declared["duration"] / subject.design.period)
    yield replace(recomputed(subject, "tube.flights.steps", steps, "copied"), fields=("tube.flights.steps",))
    names = ("fault_start", "duration", "elevator_effectiveness")
    check = equal(subject, "tube.flights.nominal_fingerprint", fly(parts).fingerprint)
    ramp = under("inputs.disturbance.ramp", declared.get("ramp") or ())
    yield replace(check, fields=(*check.fields, *under("inputs.disturbance", names), *ramp))


def _measured(subject: Subject, flown: Sequence[Evidence]) -> Checks:
    """Yield the checks of the extremes over the flights that measure W: of disturbances, and of the plan's lag."""
    field = "tube.disturbance.measured"
    for k, (side, extreme) in enumerate((("lower", np.min), ("upper", np.max))):
        channels = np.array([f.channels[k] for f in flown])
        yield recomputed(subject, f"{field}.{side}", extreme(channels, axis=0), "flights")
        attained = [channels[i, j] for j, i in enumerate(subject.stated(f"{field}.{side}_flight"))]
        check = recomputed(subject, f"{field}.{side}", attained, "flights")
        yield replace(check, name=f"{field}.{side}_flight", fields=(f"{field}.{side}_flight",))
        if subject.design.actuators:
            sign, inflation = 2.0 * k - 1.0, subject.stated("inputs.disturbance.inflation")
            worst = sign * inflated_bounds(sign * extreme([f.lag[k] for f in flown], axis=0), inflation)
            yield recomputed(subject, f"tube.tightening.lag_feedback.{side}", worst, "flights")


def _pinned(subject: Subject, field: str, value: float) -> Check:
    """Return the check of an extreme with the flight that has it."""
    return replace(recomputed(subject, field, value, "flights"), fields=(field, f"{field}_flight"))


def _lag_check(name: str, subject: Subject, flown: Sequence[Evidence]) -> Check:
    """Return the check that the feedback's response to the lag of the actuators stays within the stated bounds.

    The check is our own: the paper's actuators have no dynamics, so that they do not lag behind the plan.
    """
    lower, upper = lag_feedback(subject)
    room = min(float(min((f.lag[0] - lower).min(), (upper - f.lag[1]).min())) for f in flown)
    return above(f"{name}, room to its bounds", room, -ROUNDING)


def _rate_checks(name: str, subject: Subject, flown: Sequence[Evidence]) -> Checks:
    """Yield the check that altitude and velocity change no faster than the bounds of the feedback require, if they do.

    The check is our own: the paper's set holds for any change.
    """
    tube = subject.design.tube
    if tube is not None and len(tube.rates):
        share = max(float((f.moved / (subject.design.period * tube.rates)).max()) for f in flown)
        yield at_most(f"{name}: rates of altitude and velocity, share of the certified ones", share, 1.0)


def sequence_checks(subject: Subject, seed: int) -> Checks:
    """Yield the check of random disturbance sequences, whose errors must stay in the tube's set (eq. 26)."""
    tube = Tube(subject, subject.design, "tube")
    drawn = random_sequences(tube.A, tube.columns, tube.c, tube.Q, SEQUENCES, STEPS, seed)
    yield at_most(f"worst level of {SEQUENCES} random sequences", drawn["worst_level"], 1.0)


def bounding_corners(subject: Subject) -> list[Corner]:
    """Return the nominal vehicle and those corners of the parameters at which a disturbance bound was measured."""
    measured = subject.stated("tube.disturbance.measured")
    seen = fraction(subject.vehicle.uncertainty, share_of(subject.certificate["inputs"]))
    return [seen[i] for i in sorted({0, *measured["lower_flight"], *measured["upper_flight"]})]


def scenario_checks(
    subject: Subject, scenario: Scenario, over: Sequence[Corner] = ({},), progress: Progress = lambda *_: None
) -> Checks:
    """Fly ``scenario`` with each vehicle in ``over``; check level (eq. 26), disturbances (eq. 19) and plan (eq. 30).

    Vehicles are given by relative changes. With actuators, the feedback's response to their lag is checked, too.

    Raises:
        DesignError: The controller is not the tube law, a flight diverged, or an input was limited.
    """
    name = scenario.name
    if scenario.controller != "tube_mpc":
        raise DesignError(f"scenario {name!r}: controller = {scenario.controller!r}, expected 'tube_mpc'")
    parts, tube, flown = assemble_flight(scenario, subject.design), Tube(subject, subject.design, "tube"), []
    model = ChannelModel(subject.design, subject.vehicle)
    for corner in over:
        flown.append(evidence(model, tube, fly(parts.perturbed(corner))))
        progress("flights", len(flown), len(over))
    yield at_most(f"{name}: level in the set", max(f.level for f in flown), 1.0)
    worst, share = max(flown, key=lambda f: f.ratio), share_of(subject.certificate["inputs"])
    held = f" (W' holds {share:g} of fault and parameter bounds, eq. 47)" if share < 1.0 else ""
    where = f"{name}: disturbance over its bound, {worst.channel} at step {worst.step}{held}"
    yield at_most(where, worst.ratio, 1.0)
    if subject.design.actuators:
        yield _lag_check(f"{name}: feedback to the lag of the plan", subject, flown)
    yield from _rate_checks(name, subject, flown)
    room = plan_room(subject.stated("tube.tightening"), flown)
    yield above(f"{name}: room of the nominal plan in U minus F Z", room, 0.0)


def plan_room(bounds: Mapping[str, Any], flown: Sequence[Evidence]) -> float:
    """Return the least distance of the plans of flights from the tightened ``bounds``, negative beyond them."""
    rooms = [(f.lowest[:2] - bounds["lower"], bounds["upper"] - f.highest[:2]) for f in flown]
    return float(np.min(rooms))


def verify(
    subject: Subject, quick: bool = False, progress: Progress = lambda *_: None, *, seed: int, flights: int = DRAWN
) -> dict[str, list[Check]]:
    """Return the checks by part; with ``quick``, those without flights and random sequences.

    Args:
        subject: Design and certificate.
        quick: Whether to omit flights and random sequences.
        progress: Called with the name of a part, and whether it is done.
        seed: Seed of the flights, the random sequences and the corners whose margins are computed.
        flights: Number of flights to draw.
    """
    flown: dict[str, Part] = {
        "flights": partial(flight_checks, seed=seed, number=flights),
        "random sequences": partial(sequence_checks, seed=seed),
    }
    checks: dict[str, list[Check]] = {}
    margins: dict[str, Part] = {"margins": partial(margin_checks, seed=seed)}
    for name, part in (QUICK | RECOMPUTED | margins | ({} if quick else flown)).items():
        progress(name, 0, 1)
        checks[name] = list(gathered(name, partial(part, subject)))
        progress(name, 1, 1)
    made = [check for part in checks.values() for check in part]
    checks["fields"] = list(gathered("fields", partial(field_checks, subject, made, FLOWN_FIELDS if quick else ())))
    return checks

"""Verification of a design by flights and random sequences; :mod:`hsv.certificate.verification` has the other checks.

Nothing here uses the code that computes designs. The core simulates the flights. The disturbances of a flight are the
part of its motion that the polytopic model does not explain, eq. 13 to 19.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.certificate.checks import Check, Checks, Subject, above, at_most, gathered, recomputed
from hsv.certificate.tolerances import ROUNDING, TOLERANCES
from hsv.certificate.verification import (
    QUICK,
    RECOMPUTED,
    Part,
    Tube,
    acceleration_channels,
    lag_feedback,
    level,
)
from hsv.control.design import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.flight.assembly import assemble_flight, assemble_with
from hsv.flight.closed_loop import Components, fly
from hsv.flight.corners import Corner, corners, fraction, region_parameters
from hsv.flight.flight import Flight
from hsv.flight.random_sequences import random_sequences
from hsv.flight.responses import along_filter, lag_response
from hsv.flight.scenario import Scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.lpv.polytope import evaluate
from hsv.model.plant import FlightStatus
from hsv.model.signals import ACCELERATED, CHANNELS, N_INPUTS, N_RIGID, N_STATES, PITCH_RATE, REMAINING
from hsv.model.trim import trim

_FLIGHTS, _SEED = 48, 7
"""Number and seed of random corners that are flown in addition to those that determine a bound."""


def region(subject: Subject, design: ControlDesign, share: float) -> Components:
    """Return the components for the flight that the design declares, with ``share`` of its fault (eq. 47)."""
    declared = region_parameters(subject.certificate["inputs"], subject.vehicle, share)
    return assemble_with(design, declared)


class Disturbances(NamedTuple):
    """Disturbances, tube error, and the feedback's response to the actuators' lag in a flight; one row per step, SI.

    ``channels``, shape (n, 7), are the disturbances in the order of :data:`~hsv.model.signals.CHANNELS`.
    ``error``, shape (n + 1, states), is the tube error e, less its response to the lag of the actuators behind the
    plan u_r + u_n. ``lag``, shape (n + 1, 2), is the response of the feedback to this lag, 0 without actuators.
    """

    channels: np.ndarray
    error: np.ndarray
    lag: np.ndarray


def disturbances(subject: Subject, flight: Flight) -> Disturbances:
    """Return the disturbances in a flight (eq. 13 to 18), its tube error (eq. 22) and the response to actuator lag.

    The disturbance is Delta(k) = x(k+1) - [x_r(k+1) + d_r(k)] - A(p) (x - x_r) - B(p) (u - u_r), where p is the
    altitude and velocity of step k. One channel is the lost elevator deflection (actuator input minus command); Delta
    contains it times the elevator's column of B(p). The rigid part of the rest is expressed by three accelerations,
    constant over a period, and two residuals, of altitude and pitch angle. With actuators, u and the contribution of
    the lost deflection to Delta are computed from mean positions over a period. The remaining channel is not part of
    Delta: the change of the nominal pitch rate by the notch filter, 0 if the design filters that rate.
    """
    design, vehicle, h = subject.design, subject.vehicle, flight.history
    notch, plan = discretise(design.notch, design.period), flight.plan
    lost = np.zeros_like(h.command)
    lost[:, 1] = (h.actuator - h.command)[:, 1]
    acting, through = h.command, lost
    if design.actuators:
        actuators = sampled_actuators(design.actuator_sets, design.period)
        at_rest = trim(vehicle.decoupled, h.state[0, 0], h.state[0, 1]).input
        acting, through = at_rest + respond(actuators, h.command - at_rest)[1], respond(actuators, lost)[1]
    polytope = design.polytope
    S = np.concatenate((polytope.A, polytope.B), axis=2)
    at = evaluate(polytope.altitude, h.state[:-1, 0]), evaluate(polytope.velocity, h.state[:-1, 1])
    weights = (at[0][:, :, None] * at[1][:, None, :]).reshape(len(at[0]), -1)
    S = (weights @ S.reshape(len(S), -1)).reshape(-1, N_STATES, N_STATES + N_INPUTS)
    moved = np.hstack((h.state - flight.reference, acting - flight.reference_input))[:-1]
    delta = h.state[1:] - flight.reference[1:] - flight.defect[:-1] - np.einsum("kij,kj->ki", S, moved)
    rest = delta - S[:, :, -1] * through[:-1, 1:]
    columns, rate = acceleration_channels(vehicle, design.period), (h.deviation + flight.reference)[:-1, PITCH_RATE]
    channels = np.zeros((len(rest), len(CHANNELS)))
    channels[:, :3] = np.linalg.solve(columns[ACCELERATED], rest[:, ACCELERATED].T).T
    channels[:, 3] = lost[:-1, 1]
    channels[:, 4] = 0.0 if design.filtered else along_filter(notch, rate)[0] - rate
    channels[:, 5:] = rest[:, REMAINING] - channels[:, :3] @ columns[REMAINING].T
    rigid = (h.state - h.deviation - flight.reference)[:, :N_RIGID]
    error = np.hstack((rigid, along_filter(notch, rigid[:, PITCH_RATE])[1]))
    if not design.actuators:
        return Disturbances(channels, error, np.zeros_like(h.command))
    error = np.hstack((error, respond(actuators, h.actuator - plan)[0]))
    late = at_rest + respond(actuators, plan - at_rest)[1] - plan
    gain = design.feedback_gain[:, :N_RIGID] * design.tau
    moved_by_lag, lag = lag_response(polytope, gain, notch, actuators, h.state[:, :2], late)
    return Disturbances(channels, error - moved_by_lag, lag)


@dataclass(frozen=True)
class Evidence:
    """Extremes of a flight: largest ``level`` in the tube, and largest ``ratio`` of a disturbance to its bound.

    The largest ratio occurs in ``channel`` at ``step``. ``lowest`` and ``highest``, shape (3,), are the extremes of the
    two inputs u_r + u_n and of the nominal pitch acceleration (rad/s^2). ``lag``, shape (2, 2), and ``channels``, shape
    (2, 7), have the minima (row 0) and maxima (row 1) of the two fields of :class:`Disturbances` with these names.
    """

    level: float
    ratio: float
    channel: str
    step: int
    lowest: np.ndarray
    highest: np.ndarray
    lag: np.ndarray
    channels: np.ndarray


def evidence(subject: Subject, tube: Tube, flight: Flight) -> Evidence:
    """Return the extremes of ``flight`` that are compared with the ``tube``.

    Raises:
        DesignError: The flight diverged, or an input was limited.
    """
    h = flight.history
    if flight.status is not FlightStatus.FINISHED or np.any(h.command != h.u_unsaturated):
        raise DesignError(f"flight: {flight.status.name}, expected FINISHED, no input limited")
    found = disturbances(subject, flight)
    bounds = np.where(found.channels > 0.0, tube.upper, tube.lower)
    ratios = np.where(found.channels == 0.0, 0.0, np.inf)
    np.divide(found.channels, bounds, out=ratios, where=bounds != 0.0)
    step, channel = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    plan = flight.plan
    turning = np.diff(h.deviation[:, PITCH_RATE]) / flight.period
    return Evidence(
        float(level(tube.Q, found.error - tube.c).max()),
        float(ratios[step, channel]),
        CHANNELS[channel].name,
        int(step),
        np.append(plan.min(axis=0), turning.min()),
        np.append(plan.max(axis=0), turning.max()),
        np.stack((found.lag.min(axis=0), found.lag.max(axis=0))),
        np.stack((found.channels.min(axis=0), found.channels.max(axis=0))),
    )


def share_of(inputs: Mapping[str, Any]) -> float:
    """Return the share of fault and parameter bounds that W' covers (eq. 47): largest tau, 1 if tau is fixed."""
    return float(max(inputs["adjustable"]["tau"])) if inputs.get("adjustable") else 1.0


def flight_checks(subject: Subject) -> Checks:
    """Yield the checks of flights at the corners where a bound of W was measured (eq. 19), and at random corners.

    Errors must stay in the set (eq. 26), and plans u_r + u_n in the stated range, which is within the bounds of eq. 30.
    The check of the pitch acceleration is our own.
    """
    certified = replace(subject.design, tau=subject.design.tau_minimum)  # a flight may use another tau
    subject = replace(subject, design=certified)
    tube, share, bounds = Tube(subject, certified, "tube"), share_of(subject.certificate["inputs"]), subject.vehicle
    parts, seen = region(subject, certified, share), fraction(bounds.uncertainty, share)
    measured = subject.stated("tube.disturbance.measured")
    setters = sorted({0, *measured["lower_flight"], *measured["upper_flight"]})

    def show(corner: Corner, flight: Flight) -> Evidence:
        return evidence(subject, tube, flight)

    again = fly_perturbed(parts, [seen[i] for i in setters], show)
    for k, side in enumerate(("lower", "upper")):
        attained = [again[setters.index(i)].channels[k, j] for j, i in enumerate(measured[f"{side}_flight"])]
        field = f"tube.disturbance.measured.{side}"
        yield replace(recomputed(subject, field, attained, "flights"), fields=(field, f"{field}_flight"))
    yield recomputed(subject, "tube.disturbance.flights", len(seen), "copied")
    everyone = corners(bounds.uncertainty, share)
    yield recomputed(subject, "tube.flights.flights", len(everyone), "copied")
    drawn = np.random.default_rng(_SEED).choice(len(everyone), min(_FLIGHTS, len(everyone)), replace=False)
    flown = [*again, *fly_perturbed(parts, [everyone[i] for i in (0, *drawn)], show)]
    yield from _worst(subject, "tube.flights", flown)
    plan = subject.stated("tube.tightening.plan")
    low, high = plan["pitch_acceleration"]
    least, most = np.append(plan["lowest"], low), np.append(plan["highest"], high)
    yield above("nominal plan of flown corners, lowest", min(float(np.min(f.lowest - least)) for f in flown), -ROUNDING)
    yield above(
        "nominal plan of flown corners, highest", min(float(np.min(most - f.highest)) for f in flown), -ROUNDING
    )
    yield _lag_check("feedback to the lag of the plan", subject, flown)
    if "adjustable" in subject.certificate:
        # Our own check: with the whole fault (W), too, these flights stay in the set for W' (eq. 47), beyond eq. 26.
        whole, everyone = region(subject, certified, 1.0), corners(bounds.uncertainty, 1.0)
        field = "adjustable.complete_fault"
        yield recomputed(subject, f"{field}.flights", len(everyone), "copied")
        yield from _worst(subject, field, fly_perturbed(whole, [everyone[i] for i in (0, *drawn)], show))


def _worst(subject: Subject, field: str, flown: Sequence[Evidence]) -> Checks:
    """Yield the checks of the flights' levels (at most 1) and disturbances against the certificate's, in ``field``."""
    stated, allowance = subject.stated(field), 1.0 + TOLERANCES["flights"].relative
    yield at_most(f"{field}: level", max(f.level for f in flown), min(1.0, stated["worst_level"] * allowance))
    ratio = stated["disturbance_membership"]["worst_ratio"] * allowance
    yield at_most(f"{field}: disturbance over its bound", max(f.ratio for f in flown), ratio)


def _lag_check(name: str, subject: Subject, flown: Sequence[Evidence]) -> Check:
    """Return the check that the feedback's response to the lag of the actuators stays within the stated bounds.

    The check is our own: the paper's actuators have no dynamics, so that they do not lag behind the plan.
    """
    lower, upper = lag_feedback(subject)
    room = min(float(min((f.lag[0] - lower).min(), (upper - f.lag[1]).min())) for f in flown)
    return above(f"{name}, room to its bounds", room, -ROUNDING)


def sequence_checks(subject: Subject) -> Checks:
    """Yield the checks of repeated random disturbance sequences, whose errors must stay in the tube's set (eq. 26)."""
    tube, field = Tube(subject, subject.design, "tube"), "tube.invariant_set.sampling"
    numbers = subject.count(f"{field}.sequences", 1_000_000), subject.count(f"{field}.steps", 10_000)
    drawn = random_sequences(tube.A, tube.columns, tube.c, tube.Q, *numbers, subject.stated(f"{field}.seed"))
    yield at_most("worst level of random sequences", drawn["worst_level"], 1.0)
    check = recomputed(subject, f"{field}.worst_level", drawn["worst_level"], "random sequences")
    yield replace(check, fields=(check.name, *(f"{field}.{name}" for name in ("sequences", "steps", "seed"))))
    for start in ("worst_level_from_zero", "worst_level_from_boundary"):
        for kind, value in drawn[start].items():
            yield recomputed(subject, f"{field}.{start}.{kind}", value, "random sequences")


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
    for corner in over:
        flown.append(evidence(subject, tube, fly(parts.perturbed(corner))))
        progress("flights", len(flown), len(over))
    yield at_most(f"{name}: level in the set", max(f.level for f in flown), 1.0)
    worst, share = max(flown, key=lambda f: f.ratio), share_of(subject.certificate["inputs"])
    held = f" (W' holds {share:g} of fault and parameter bounds, eq. 47)" if share < 1.0 else ""
    where = f"{name}: disturbance over its bound, {worst.channel} at step {worst.step}{held}"
    yield at_most(where, worst.ratio, 1.0)
    if subject.design.actuators:
        yield _lag_check(f"{name}: feedback to the lag of the plan", subject, flown)
    stated = subject.stated("tube.tightening")
    room = min(min((f.lowest[:2] - stated["lower"]).min(), (stated["upper"] - f.highest[:2]).min()) for f in flown)
    yield above(f"{name}: room of the nominal plan in U minus F Z", float(room), 0.0)


FLOWN: dict[str, Part] = {"flights": flight_checks, "random sequences": sequence_checks}
"""The checks that take longer, by part of the verification."""


def verify(subject: Subject, quick: bool = False, progress: Progress = lambda *_: None) -> dict[str, list[Check]]:
    """Return the checks by part; with ``quick``, those without flights and random sequences."""
    checks: dict[str, list[Check]] = {}
    for name, part in (QUICK | RECOMPUTED | ({} if quick else FLOWN)).items():
        progress(name, 0, 1)
        checks[name] = list(gathered(name, partial(part, subject)))
        progress(name, 1, 1)
    return checks

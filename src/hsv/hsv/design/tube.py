"""The tube of a design: disturbances (paper eq. 19), invariant set (eq. 26), tightened inputs (eq. 30), evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.control.design import ControlDesign, PlanBounds
from hsv.design.disturbance import DisturbanceSet, widened
from hsv.design.inputs import DesignInputs, InvariantSetInputs
from hsv.design.region import Region, RegionResult, incomplete_share, measure
from hsv.design.sets.counter_example import counter_examples
from hsv.design.sets.invariant_set import InvariantSet, ellipsoid
from hsv.design.sets.star_norms import star_norms
from hsv.design.tightening import TightenedInputs, check_plan, plan_bounds, tighten
from hsv.design.tube_problem import TubeProblem, tube_problem
from hsv.flight.disturbance import ChannelModel, Membership, membership, plan_extremes
from hsv.flight.flight import Flight
from hsv.flight.random_sequences import random_sequences

SEQUENCES, STEPS, SEED = 100_000, 600, 1
"""Number of random sequences that test the set, their steps and their seed."""


@dataclass(frozen=True)
class Tube:
    """The invariant set (``found``), tightened ``bounds``, bounds for other plans (``plan``), ``report`` for JSON."""

    found: InvariantSet
    bounds: TightenedInputs
    plan: PlanBounds
    report: dict[str, Any]


def invariant_set(
    problem: TubeProblem, inputs: InvariantSetInputs, progress: Progress = lambda *_: None
) -> InvariantSet:
    """Return the invariant ellipsoid, with star norms if ``inputs.method`` selects them.

    Raises:
        DesignError: No invariant set was found.
    """
    progress("invariant set", 0, 1)
    found = ellipsoid(problem, inputs.state_scale.array(), inputs.input_scale.array(), inputs.contraction)
    progress("invariant set", 1, 1)
    if inputs.method == "ellipsoid":
        return found
    return replace(found, star_norms=star_norms(problem, found.centre, partial(progress, "star norms")))


@dataclass(frozen=True)
class MeasuredSet:
    """The certified invariant set for the disturbances measured over a region, and the tightened bounds."""

    measured: RegionResult
    disturbance: DisturbanceSet
    found: InvariantSet
    certified: dict[str, Any]
    bounds: TightenedInputs
    lag: tuple[np.ndarray, np.ndarray] | None
    """Minimum and maximum, shape (2,) each, of the feedback due to the actuators' lag; None: ideal actuators."""

    def report(self) -> dict[str, Any]:
        """Return the disturbance set, the invariant set and the tightened inputs, for JSON."""
        lag = {"lag_feedback": {"lower": self.lag[0].tolist(), "upper": self.lag[1].tolist()}} if self.lag else {}
        return {
            "disturbance": {"channels": self.disturbance.report()},
            "invariant_set": {**self.found.report(), "certificate": self.certified},
            "tightening": {**lag, "lower": self.bounds.lower.tolist(), "upper": self.bounds.upper.tolist()},
        }


def measured_set(design: ControlDesign, region: Region, inputs: DesignInputs, progress: Progress) -> MeasuredSet:
    """Return the invariant set of ``design`` for the disturbances measured over ``region``.

    The flights are those of :meth:`Region.fraction`: the nominal vehicle, and all corners or a quarter of them.

    Raises:
        DesignError: A flight diverges or saturates; no invariant set was found, or it fails when recomputed; or its
            feedback needs the whole range of an input.
    """
    seen, vehicle = region.fraction(), inputs.flown_vehicle
    model = ChannelModel(design, vehicle)
    measured = measure(region, model, seen, lambda done: progress("disturbances", done, len(seen)))
    disturbance = measured.channels.structured(inputs.disturbance.inflation).scaled(inputs.disturbance.share)
    found = invariant_set(tube_problem(design, vehicle, disturbance), inputs.invariant_set, progress)
    if inputs.invariant_set.rates:
        found = found.limited(design, inputs.invariant_set.rates.array())
    certified = found.certify()
    lag = None
    if design.actuators:
        worst = measured.lag_feedback
        lag = widened(worst.lower, worst.upper, inputs.disturbance.inflation)
    bounds = tighten(found, design.input_minimum, design.input_maximum, lag)
    return MeasuredSet(measured, disturbance, found, certified, bounds, lag)


def design_tube(design: ControlDesign, inputs: DesignInputs, progress: Progress) -> Tube:
    """Return the certified tube of ``design`` for its declared region, with evidence from flights at all corners.

    The disturbances are measured only in flights of :meth:`Region.fraction`; any others test the set independently.

    Raises:
        DesignError: As for :func:`measured_set`, or if the nominal plan exceeds the tightened bounds.
    """
    region = Region(design, inputs, incomplete_share(inputs))
    tube = measured_set(design, region, inputs, progress)
    return certified_tube(design, inputs, region, tube, progress)


def certified_tube(
    design: ControlDesign, inputs: DesignInputs, region: Region, tube: MeasuredSet, progress: Progress
) -> Tube:
    """Return the certified ``tube`` with its evidence: random sequences, counter-examples, flights at all corners.

    Raises:
        DesignError: A random sequence leaves the set, a flight leaves all of W, or the plan exceeds the bounds.
    """
    found, bounds = tube.found, tube.bounds
    progress("random sequences", 0, 1)
    columns = found.problem.columns(found.centre)
    drawn = random_sequences(found.problem.system.A, columns, found.centre, found.Q, SEQUENCES, STEPS, SEED)
    progress("random sequences", 1, 1)
    if not drawn["worst_level"] <= 1.0:
        raise DesignError(f"invariant set: level {drawn['worst_level']:.9g} in a random sequence, expected at most 1")

    flown = flights_in_tube(ChannelModel(design, inputs.flown_vehicle), region, found, progress)
    lowest, highest = (np.array([getattr(f, side) for f in flown]) for side in ("lowest", "highest"))
    least, most = lowest.min(axis=0), highest.max(axis=0)
    plan = check_plan(bounds, least[:2], most[:2]) | {
        "lowest": least.tolist(),
        "highest": most.tolist(),
        "lowest_flight": lowest.argmin(axis=0).tolist(),
        "highest_flight": highest.argmax(axis=0).tolist(),
    }
    report = tube.report()
    lower, upper = found.problem.step_bounds()
    report["disturbance"] |= {
        "step": {"lower": lower.tolist(), "upper": upper.tolist()},
        "flights": tube.measured.flights,
        "measured": {name: extreme.tolist() for name, extreme in vars(tube.measured.channels).items()},
    }
    report["invariant_set"]["counter_examples"] = counter_examples(found.problem).as_dict()
    report["tightening"]["plan"] = plan
    report["flights"] = flights_report(flown) | membership_report(flown) | nominal_report(region)
    if inputs.disturbance.share == 1.0 and report["flights"]["outside"]:
        worst = max(flown, key=lambda f: f.membership.ratio).membership
        raise DesignError(
            f"disturbance set: a flight reaches {worst.ratio:.4g} of {worst.channel}, expected at most 1: "
            "a larger inflation helps"
        )
    return Tube(found, bounds, plan_bounds(bounds, least, most), report)


def flights_in_tube(
    model: ChannelModel, region: Region, found: InvariantSet, progress: Progress
) -> list[FlightEvidence]:
    """Simulate the nominal vehicle and all corners of ``region``; return the :func:`flight_evidence`, in order."""
    everyone = region.corners()
    tell = partial(progress, "flights in the tube")
    return region.map(lambda flight: flight_evidence(flight, found, model), everyone, lambda n: tell(n, len(everyone)))


@dataclass(frozen=True)
class FlightEvidence:
    """Evidence of one flight: largest ``level`` of the tube error e, and ``membership`` of the disturbances in W.

    ``lowest`` and ``highest``: extremes of the two total nominal inputs, then of the nominal pitch acceleration
    (rad/s^2).
    """

    level: float
    membership: Membership
    lowest: np.ndarray
    highest: np.ndarray


def flight_evidence(flight: Flight, found: InvariantSet, model: ChannelModel) -> FlightEvidence:
    """Return the evidence of ``flight`` for the invariant set ``found``; ``model`` computes its disturbances."""
    level, bounds = float(found.levels(model.errors(flight)[0]).max()), found.problem.disturbance
    inside = membership(model.channels(flight), bounds.lower, bounds.upper)
    return FlightEvidence(level, inside, *plan_extremes(flight))


def flights_report(flown: list[FlightEvidence]) -> dict[str, Any]:
    """Return the number of flights, their largest level, and the flight that has it, for JSON."""
    levels = [f.level for f in flown]
    worst = int(np.argmax(levels))
    return {"flights": len(flown), "worst_level": levels[worst], "worst_level_flight": worst}


def membership_report(flown: list[FlightEvidence]) -> dict[str, Any]:
    """Return how many flights leave W, and the largest ratio to a bound with its flight, channel and step, for JSON."""
    worst = int(np.argmax([f.membership.ratio for f in flown]))
    at = flown[worst].membership
    return {
        "outside": sum(f.membership.ratio > 1.0 for f in flown),
        "worst_ratio": at.ratio,
        "worst_ratio_flight": worst,
        "channel": at.channel,
        "step": at.step,
    }


def nominal_report(region: Region) -> dict[str, Any]:
    """Return the number of steps and the fingerprint of the nominal flight of ``region``, for JSON."""
    flight = region.fly({})
    return {"steps": len(flight.time) - 1, "nominal_fingerprint": flight.fingerprint}

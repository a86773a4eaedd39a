"""Claims of the tube: disturbances, invariance at every vertex, half-widths, tightened bounds, flights, sequences."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from hsv.design.disturbance import DisturbanceSet
from hsv.design.lmi import SolverReport
from hsv.design.region import Extremes, Region, corners, fraction, measure
from hsv.design.sets.ellipsoid import EllipsoidSet, from_shape, vertex_residuals
from hsv.design.sets.sampling import sample
from hsv.design.tightening import plan_bounds, tighten
from hsv.design.tube import channel_model, flight_evidence, tube_problem
from hsv.design.verification.claims import Claim, Subject, above, at_most, same
from hsv.design.verification.gains import inverse

_FLIGHTS, _FLIGHT_SEED = 48, 7
"""How many corners, drawn with which seed, are flown again beside those that set a bound."""


def certified_set(subject: Subject) -> EllipsoidSet:
    """Return the ellipsoid that the certificate describes, for the design as it flies."""
    stored = subject.certificate["tube"]
    s = stored["invariant_set"]
    disturbance = DisturbanceSet.from_report(stored["disturbance"]["channels"])
    return from_shape(
        tube_problem(subject.design, disturbance),
        np.array(s["centre"]),
        np.array(s["Q"]),
        s["contraction"],
        np.array(s["multipliers"]),
        SolverReport(**s["solver"], time=0.0),
    )


def set_claims(subject: Subject) -> Iterable[Claim]:
    """Recompute invariance, half-widths and tightened bounds from the stored matrices; milliseconds."""
    stored, design = subject.certificate["tube"], subject.design
    s = stored["invariant_set"]
    yield Claim("invariant set", s["kind"], "ellipsoid", s["kind"] == "ellipsoid")
    yield Claim("tube parameters", str(design.tube is not None), "True", design.tube is not None)
    found = certified_set(subject)
    if design.tube is not None:
        yield same("tube.centre", design.tube.centre, found.centre)
        yield inverse("tube.shape = Q^-1", design.tube.shape, found.Q)
        yield same("tube.half_width from Q", design.tube.half_width, found.half_width)
    yield same("certified half-widths from Q", s["half_width"], found.half_width)
    yield same("feedback half-ranges from Q", s["feedback_half_range"], found.feedback)
    measured, inputs = stored["disturbance"]["measured"], subject.inputs.disturbance
    extremes = Extremes(*(np.array(measured[k]) for k in ("lower", "upper", "lower_flight", "upper_flight")))
    expected = extremes.structured(inputs.inflation).scaled(inputs.share)
    given = found.problem.disturbance
    yield same("disturbance bounds, lower", given.lower, expected.lower)
    yield same("disturbance bounds, upper", given.upper, expected.upper)
    residuals = vertex_residuals(found.problem, found.centre, found.Q, found.contraction, found.multipliers)
    yield above("invariance, smallest eigenvalue over the vertices", residuals.min(), 0.0)
    yield at_most("level of e = 0", float(found.level(np.zeros(len(found.Q)))), 1.0)
    bounds, kept = tighten(found, design.input_minimum, design.input_maximum), stored["tightening"]
    yield same("tightened bounds, lower", kept["lower"], bounds.lower)
    yield same("tightened bounds, upper", kept["upper"], bounds.upper)
    plan = kept["plan"]
    margins = bounds.margins(np.array(plan["lowest"]), np.array(plan["highest"]))
    yield above("room of the nominal plan", margins.min(), 0.0)
    low, high = plan["pitch_acceleration"]
    allowed = plan_bounds(bounds, np.append(plan["lowest"], low), np.append(plan["highest"], high))
    yield Claim("nominal plan bounds", str(design.plan_bounds is not None), "True", design.plan_bounds is not None)
    if design.plan_bounds is not None:
        for name, value in vars(design.plan_bounds).items():
            yield same(f"nominal.{name} from the tightened bounds and plans", value, getattr(allowed, name))


def flight_claims(subject: Subject) -> Iterable[Claim]:
    """Fly the corners that set a bound, and a sample of all, again."""
    stored, design = subject.certificate["tube"], subject.design
    region, model = Region(design, subject.inputs), channel_model(design)
    measured = stored["disturbance"]["measured"]
    seen, everyone = fraction(), corners()
    setters = sorted({0, *measured["lower_flight"], *measured["upper_flight"]})
    again = measure(region, model, [seen[i] for i in setters]).channels
    for side, value in (("lower", again.lower), ("upper", again.upper)):
        yield same(f"measured disturbances, {side}", value, measured[side], 1e-6, 1e-12)
    found = certified_set(subject)
    disturbance = found.problem.disturbance
    drawn = np.random.default_rng(_FLIGHT_SEED).choice(len(everyone), _FLIGHTS, replace=False)
    flown = region.map(
        lambda flight: flight_evidence(flight, found, disturbance, model), [everyone[i] for i in (0, *drawn)]
    )
    kept = stored["flights"]
    level = max(f.level or 0.0 for f in flown)
    yield at_most("level of flown corners", level, min(1.0, kept["worst_level"] * (1.0 + 1e-6)))
    ratio = max(f.membership.ratio for f in flown)
    yield at_most("disturbances of flown corners", ratio, kept["disturbance_membership"]["worst_ratio"] * (1.0 + 1e-6))
    plan = stored["tightening"]["plan"]
    low, high = plan["pitch_acceleration"]
    least, most = np.append(plan["lowest"], low), np.append(plan["highest"], high)
    lowest, highest = np.min([f.lowest for f in flown], axis=0), np.max([f.highest for f in flown], axis=0)
    yield above("nominal plan of flown corners, lowest", float(np.min(lowest - least)), -1e-9)
    yield above("nominal plan of flown corners, highest", float(np.min(most - highest)), -1e-9)


def sequence_claims(subject: Subject) -> Iterable[Claim]:
    """Draw the random sequences again."""
    kept: dict[str, Any] = subject.certificate["tube"]["invariant_set"]["sampling"]
    drawn = sample(certified_set(subject), kept["sequences"], kept["steps"], kept["seed"])
    yield at_most("worst level of random sequences", drawn["worst_level"], 1.0)
    yield same("worst level of random sequences as certified", drawn["worst_level"], kept["worst_level"], 1e-6)

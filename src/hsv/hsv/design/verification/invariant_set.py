"""Checks of the invariant set: invariance at every vertex, half-widths, disturbance bounds, tightened bounds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.design.disturbance import DisturbanceSet, Extremes
from hsv.design.sets.counter_example import counter_examples
from hsv.design.sets.ellipsoid_set import EllipsoidSet, from_report, vertex_residuals
from hsv.design.tightening import plan_bounds, tighten
from hsv.design.tube_problem import tube_problem
from hsv.design.verification.checks import Check, Subject, above, at_most, required, same, same_parameter
from hsv.model.signals import N_RIGID
from hsv.model.vehicle import Vehicle


def certified_set(subject: Subject) -> EllipsoidSet:
    """Return the ellipsoid that the certificate describes, for the design as it flies."""
    return stored_set(subject.design, subject.vehicle, subject.certificate["tube"])


def stored_set(design: ControlDesign, vehicle: Vehicle, stored: dict[str, Any]) -> EllipsoidSet:
    """Return the ellipsoid that ``stored``, a tube in a certificate, describes for ``design`` of ``vehicle``."""
    disturbance = DisturbanceSet.from_report(stored["disturbance"]["channels"])
    return from_report(tube_problem(design, vehicle, disturbance), stored["invariant_set"])


def lag_feedback(tightening: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the bounds of the feedback to the lag of the plan in a certificate; none where actuators are ideal."""
    lag = tightening.get("lag_feedback")
    return (np.array(lag["lower"]), np.array(lag["upper"])) if lag else None


def set_checks(subject: Subject) -> Iterable[Check]:
    """Recompute invariance, half-widths and tightened bounds from the stored matrices; milliseconds."""
    stored, design = subject.certificate["tube"], subject.design
    s = stored["invariant_set"]
    yield Check("invariant set", s["kind"], "ellipsoid", s["kind"] == "ellipsoid")
    yield Check("tube parameters", str(design.tube is not None), "True", design.tube is not None)
    found = certified_set(subject)
    if design.tube is not None:
        seen = found.seen()
        yield required(same_parameter(subject, "tube.centre", design.tube.centre, seen.centre))
        yield required(same_parameter(subject, "tube.shape", design.tube.shape, seen.shape, "tube.shape = Q^-1"))
        half_width, name = design.tube.half_width, "tube.half_width from Q"
        yield required(same_parameter(subject, "tube.half_width", half_width, seen.half_width, name))
    yield same("certified half-widths from Q", s["half_width"], found.half_width, "half-widths")
    yield same("feedback half-ranges from Q", s["feedback_half_range"], found.feedback, "half-widths")
    measured, inputs = stored["disturbance"]["measured"], subject.certificate["inputs"]["disturbance"]
    extremes = Extremes(*(np.array(measured[k]) for k in ("lower", "upper", "lower_flight", "upper_flight")))
    expected = extremes.structured(inputs["inflation"]).scaled(inputs["share"])
    given = found.problem.disturbance
    yield same("disturbance bounds, lower", given.lower, expected.lower, "disturbance bounds")
    yield same("disturbance bounds, upper", given.upper, expected.upper, "disturbance bounds")
    residuals = vertex_residuals(found.problem, found.centre, found.Q, found.contraction, found.multipliers)
    yield required(above("invariance, smallest eigenvalue over the vertices", residuals.min(), 0.0))
    yield required(at_most("level of e = 0", float(found.level(np.zeros(len(found.Q)))), 1.0))
    yield same(
        "invariance, smallest eigenvalues as certified",
        s["certificate"]["lmi_smallest_eigenvalues"],
        residuals,
        "eigenvalues",
    )
    declared = subject.certificate["inputs"]["invariant_set"]["method"] == "star_norms"
    carried = found.star_norms is not None
    yield Check("star norms", str(carried), str(declared), carried == declared)
    if found.star_norms:
        least = found.star_norms.residuals(found.problem, found.centre).min()
        yield required(above("invariance of the star norms, smallest eigenvalue", least, 0.0))
        start = found.star_norms.level_at_start(found.problem, found.centre)
        yield required(at_most("level of e = 0 in the star norms", start, 1.0))
        kept = s["certificate"]["star_norms"]
        evidence = (kept["smallest_eigenvalue"], kept["level_of_zero_error"])
        yield same("star norms, evidence as certified", evidence, (least, start), "eigenvalues")
    kept = stored["tightening"]
    bounds = tighten(found, design.input_minimum, design.input_maximum, lag_feedback(kept))
    yield same("tightened bounds, lower", kept["lower"], bounds.lower, "tightened bounds")
    yield same("tightened bounds, upper", kept["upper"], bounds.upper, "tightened bounds")
    plan = kept["plan"]
    margins = bounds.margins(np.array(plan["lowest"]), np.array(plan["highest"]))
    yield above("room of the nominal plan", margins.min(), 0.0)
    low, high = plan["pitch_acceleration"]
    allowed = plan_bounds(bounds, np.append(plan["lowest"], low), np.append(plan["highest"], high))
    yield Check("nominal plan bounds", str(design.plan_bounds is not None), "True", design.plan_bounds is not None)
    if design.plan_bounds is not None:
        for name, value in vars(design.plan_bounds).items():
            parameter = f"nominal.{name}"
            claimed = f"{parameter} from the tightened bounds and plans"
            yield same_parameter(subject, parameter, value, getattr(allowed, name), claimed)


def counter_example_checks(subject: Subject) -> Iterable[Check]:
    """Fly the sequences of disturbances that drive the error far: they show what the half-widths cannot be below."""
    stored = subject.certificate["tube"]["invariant_set"]
    if "star_norms" not in stored:
        return
    found = certified_set(subject)
    kept, driven = stored["counter_examples"], counter_examples(found.problem)
    yield same("counter-examples", kept["half_range"], driven.half_range, "half-widths")
    yield same("counter-examples, vertex", kept["vertex"], driven.vertex, "copied")
    yield same("counter-examples, steps", kept["steps"], driven.steps, "copied")
    certified = np.concatenate((found.half_width[:N_RIGID], found.feedback))
    share = (driven.half_range / certified).max()
    yield required(at_most("counter-examples, largest share of a half-width", share, 1.0))

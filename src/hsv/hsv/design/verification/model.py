"""Checks of the model: vertices, weights and limits from the vehicle and the design inputs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from hsv.design.verification.checks import Check, Subject, above, required, same, same_parameter
from hsv.design.verification.tolerances import ROUNDING


def input_checks(subject: Subject) -> Iterable[Check]:
    """Compare the values that a design copies from its inputs, and check its weights."""
    design, inputs = subject.design, subject.certificate["inputs"]
    yield same("period", design.period, inputs["model"]["period"], "copied")
    notch = [[section[name] for name in vars(design.notch[0])] for section in inputs["notch"]]
    yield same("notch", [list(vars(section).values()) for section in design.notch], notch, "copied")
    coupling = inputs["disturbance"]["coupling"]
    yield Check("design.coupling", design.coupling, repr(coupling), design.coupling == coupling)
    known = " ".join(name for name in (inputs.get("actuator") or {}).values() if name)
    yield required(
        Check("design.actuators", " ".join(design.actuators), repr(known), " ".join(design.actuators) == known)
    )
    limits, digest = subject.vehicle.decoupled, subject.vehicle.digest
    yield Check("design.vehicle", design.vehicle, repr(digest), design.vehicle == digest)
    yield same_parameter(subject, "input.minimum", design.input_minimum, limits.input_minimum)
    yield same_parameter(subject, "input.maximum", design.input_maximum, limits.input_maximum)
    for axis, (_, weights) in (("altitude", design.altitude_samples), ("velocity", design.velocity_samples)):
        sums = weights.sum(axis=1)
        yield same(f"scheduling.{axis}.weights, sums", sums, np.ones_like(sums), "sums")
        yield above(f"scheduling.{axis}.weights, least", weights.min(), -ROUNDING)


def model_checks(subject: Subject) -> Iterable[Check]:
    """Compare vertices and weights with those recomputed from the vehicle's parameters."""
    design, model = subject.design, subject.model
    for name, value, expected in (
        ("model.a", design.polytope.A, model.polytope.A),
        ("model.b", design.polytope.B, model.polytope.B),
    ):
        yield same_parameter(subject, name, value, expected, f"{name} from the vehicle")
    interpolation = design.interpolation
    yield Check(
        "scheduling.interpolation", interpolation, repr(model.interpolation), interpolation == model.interpolation
    )
    for axis, samples, recomputed in (
        ("altitude", design.altitude_samples, model.altitude_samples),
        ("velocity", design.velocity_samples, model.velocity_samples),
    ):
        for index, name in enumerate(("breakpoints", "weights")):
            yield same_parameter(subject, f"scheduling.{axis}.{name}", samples[index], recomputed[index])

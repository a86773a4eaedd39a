"""Claims of the model: vertices, weights and limits from the vehicle and the design inputs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from hsv.design.verification.claims import Claim, Subject, above, same
from hsv.vehicle.envelope import INPUT_MAXIMUM, INPUT_MINIMUM

if TYPE_CHECKING:
    from hsv.design.model import DesignModel

_NOISE = 1e-15
"""An entry that is smaller at all vertices is the rounding of an exact zero (SI; real ones are far above)."""

_MODEL = 1e-7
"""Relative difference of a vertex that is allowed. The last function kept has a relative singular value of 1e-9:
processors that round differently agree on its direction to 1e-7 only, and on vertices to 1e-8."""

_WEIGHT, _WEIGHT_FLOOR = 1e-6, 4e-8
"""The same for weights, relative or absolute (seen: 1.3e-8; the least weight that is not zero is 7e-6)."""


def input_claims(subject: Subject) -> Iterable[Claim]:
    """Compare what a design copies from its inputs, and check that weights are weights."""
    design, inputs = subject.design, subject.certificate["inputs"]
    yield same("period", design.period, inputs["model"]["period"])
    notch = [[section[name] for name in vars(design.notch[0])] for section in inputs["notch"]]
    yield same("notch", [list(vars(section).values()) for section in design.notch], notch)
    coupling = inputs["disturbance"]["coupling"]
    yield Claim("design.coupling", design.coupling, repr(coupling), design.coupling == coupling)
    yield same("input.minimum", design.input_minimum, INPUT_MINIMUM)
    yield same("input.maximum", design.input_maximum, INPUT_MAXIMUM)
    for axis, (_, weights) in (("altitude", design.altitude_samples), ("velocity", design.velocity_samples)):
        sums = weights.sum(axis=1)
        yield same(f"scheduling.{axis}.weights, sums", sums, np.ones_like(sums), 1e-9)
        yield above(f"scheduling.{axis}.weights, least", weights.min(), -1e-9)


def model_claims(subject: Subject, model: DesignModel) -> Iterable[Claim]:
    """Compare vertices and weights with those recomputed from the vehicle's parameters."""
    design = subject.design
    for name, value, expected in (
        ("model.a", design.polytope.A, model.polytope.A),
        ("model.b", design.polytope.B, model.polytope.B),
    ):
        largest = np.abs(expected).max(axis=0)
        yield same(f"{name} from the vehicle", value, expected, _MODEL, np.where(largest < _NOISE, _NOISE, 0.0))
    interpolation = design.interpolation
    yield Claim(
        "scheduling.interpolation", interpolation, repr(model.interpolation), interpolation == model.interpolation
    )
    for axis, samples, recomputed in (
        ("altitude", design.altitude_samples, model.altitude_samples),
        ("velocity", design.velocity_samples, model.velocity_samples),
    ):
        yield same(f"scheduling.{axis}.breakpoints", samples[0], recomputed[0])
        yield same(f"scheduling.{axis}.weights", samples[1], recomputed[1], _WEIGHT, _WEIGHT_FLOOR)

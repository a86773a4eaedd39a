"""The ways to an invariant set side by side, for one design and its disturbances, and what no way can be below."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import paper_system
from hsv.design.inputs import InvariantSetInputs
from hsv.design.sets.box import box
from hsv.design.sets.counter_example import counter_examples
from hsv.design.sets.ellipsoid import ellipsoid
from hsv.design.sets.ellipsoid_set import EllipsoidSet
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem, mean_size
from hsv.design.sets.modal import modal_box
from hsv.design.sets.star_norm_search import star_norms
from hsv.design.sets.zonotope import zonotope
from hsv.design.tightening import tighten
from hsv.model.signals import N_RIGID


@dataclass(frozen=True)
class Row:
    """One set, or why there is none (``note``); half-widths and feedback in SI, ``size`` as :meth:`InvariantSet.size`.

    ``lower`` and ``upper`` (2): the tightened bounds of u_n + u_r, where anything is left.
    """

    name: str
    note: str = ""
    half_width: np.ndarray | None = None
    feedback: np.ndarray | None = None
    size: float | None = None
    lower: np.ndarray | None = None
    upper: np.ndarray | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the row for JSON."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(self).items()
            if value is not None
        }


def compare_sets(
    design: ControlDesign,
    problem: TubeProblem,
    delta: Mapping[str, Any],
    inflation: float,
    inputs: InvariantSetInputs,
) -> list[Row]:
    """Return a row for each way of computing the set, and a last one for the counter-examples.

    Args:
        design: Gains and vertices.
        problem: The error system with the structured disturbances.
        delta: ``lower`` and ``upper`` (9) of the box of Delta as measured (paper eq. 19), for the paper's own problem.
        inflation: Factor on that box.
        inputs: Scales, and contractions for the ellipsoid.
    """
    polytope = design.polytope
    system = paper_system(polytope.A, polytope.B, design.feedback_gain)
    bounds = DisturbanceSet(inflation * np.array(delta["lower"]), inflation * np.array(delta["upper"]))
    scales = inputs.state_scale.array(), inputs.input_scale.array()

    @cache
    def recentred() -> EllipsoidSet:
        return ellipsoid(problem, *scales, inputs.contraction)

    ways: dict[str, Callable[[], InvariantSet]] = {
        "box, nine states": lambda: box(TubeProblem(system, bounds)),
        "box": lambda: box(problem),
        "modal box": lambda: modal_box(problem),
        "zonotope": lambda: zonotope(problem),
        "ellipsoid": recentred,
        "star norms": lambda: recentred().narrowed(star_norms(problem, recentred().centre)),
    }
    rows = []
    for name, way in ways.items():
        try:
            found = way()
            found.certify()
        except DesignError as error:
            rows.append(Row(name, str(error)))
            continue
        rows.append(_row(name, found, design, scales[0]))
    driven = counter_examples(problem).half_range
    return [*rows, Row("counter-examples", "", driven[:N_RIGID], driven[N_RIGID:], mean_size(driven, scales[0]))]


def _row(name: str, found: InvariantSet, design: ControlDesign, state_scale: np.ndarray) -> Row:
    size = found.size(state_scale)
    try:
        bounds = tighten(found, design.input_minimum, design.input_maximum)
    except DesignError as error:
        return Row(name, str(error), found.half_width, found.feedback, size)
    return Row(name, "", found.half_width, found.feedback, size, bounds.lower, bounds.upper)

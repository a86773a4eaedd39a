"""Comparison of the invariant sets of a design: ellipsoid, star norms, and the lower bound by counter-examples."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.design.inputs import InvariantSetInputs
from hsv.design.sets.counter_example import counter_examples
from hsv.design.sets.invariant_set import InvariantSet, ellipsoid
from hsv.design.sets.star_norms import star_norms
from hsv.design.tightening import tighten
from hsv.design.tube_problem import TubeProblem
from hsv.model.signals import N_RIGID


@dataclass(frozen=True)
class Row:
    """A row of the comparison: half-widths of one kind of set and half-ranges of its feedback, shape (2,), SI.

    ``half_width``: of all states; for counter-examples, of the rigid ones. ``size``: geometric mean of those of the
    rigid states, scaled. ``lower`` and ``upper``, shape (2,): tightened bounds of u_n + u_r, or None. ``note``: error
    message if there is no such set or its feedback needs the whole range of an input.
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


def compare_sets(design: ControlDesign, problem: TubeProblem, inputs: InvariantSetInputs) -> list[Row]:
    """Return the rows of ellipsoid, star norms (omitted if no ellipsoid exists) and counter-examples, in this order.

    Args:
        design: Design; only the limits of its inputs are used.
        problem: Error system and disturbances.
        inputs: Scales of the sets, and contractions to try for the ellipsoid.

    Raises:
        DesignError: A vertex is not stable.
    """
    scale, rows = inputs.state_scale.array(), []
    try:
        found = ellipsoid(problem, scale, inputs.input_scale.array(), inputs.contraction)
        rows.append(_row("ellipsoid", found, design, scale))
        rows.append(_row("star norms", replace(found, star_norms=star_norms(problem, found.centre)), design, scale))
    except DesignError as error:
        rows.append(Row(("ellipsoid", "star norms")[len(rows)], str(error)))
    driven = counter_examples(problem).half_range
    return [*rows, Row("counter-examples", "", driven[:N_RIGID], driven[N_RIGID:], _mean_size(driven, scale))]


def _row(name: str, found: InvariantSet, design: ControlDesign, scale: np.ndarray) -> Row:
    found.certify()
    size = _mean_size(found.half_width, scale)
    try:
        bounds = tighten(found, design.input_minimum, design.input_maximum)
    except DesignError as error:
        return Row(name, str(error), found.half_width, found.feedback, size)
    return Row(name, "", found.half_width, found.feedback, size, bounds.lower, bounds.upper)


def _mean_size(half_width: np.ndarray, scale: np.ndarray) -> float:
    return float(np.exp(np.mean(np.log(half_width[: len(scale)] / scale))))

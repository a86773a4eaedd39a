"""Table of tolerances of designs: ``python -m hsv.control.tolerances > docs/tolerances.md``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.model.signals import INPUT_NAMES, STATE_NAMES


@dataclass(frozen=True)
class Tolerance:
    """Tolerance of an entry when it is compared with its recomputed value: the larger of two bounds.

    ``relative`` to the recomputed entry, or ``absolute`` in scaled coordinates, a share of the entry's size; the latter
    is what counts for entries that are zero, exactly or to rounding. ``size`` and ``reason`` are for the page.
    """

    relative: float
    absolute: float
    size: str
    reason: str

    def allowed(self, expected: np.ndarray, size: Any = 1.0) -> np.ndarray:
        """Return the largest difference allowed of each entry, given the ``size`` that counts as one; both SI."""
        return np.maximum(self.relative * np.abs(expected), self.absolute * np.asarray(size, float))


_HEADER = """# Tolerances of designs
Made by `python -m hsv.control.tolerances > docs/tolerances.md`, from the table that `hsv verify` uses.

Processors round differently, and the results of solvers and eigenvalue routines are not even rounded in the same order.
A value recomputed by `hsv verify` may therefore differ from the stored one by the larger of two bounds: the *relative*
one, with respect to the recomputed entry, and the *absolute* one, a fraction of the entry's size in scaled coordinates.
The second bound is for entries that are zero, or would be without rounding. An entry changed by ten times this
tolerance fails, for entries drawn from shipped designs (`tests/control/test_verification.py`).

A recomputed design agrees with the shipped one if no entry differs by more than 1e-3 of the larger of the entry and its
size (`hsv design NAME --check`); the differences found are at most 4e-8 ([why](design.md)).

| entries | relative | absolute | of the size | reason |
| --- | ---: | ---: | --- | --- |"""

_GAIN = "scale of the input over that of the state, `[model.tensor_product]`"
_DIAGONAL = "root of the product of the two diagonal entries"
_ONE = "1 (SI)"

TOLERANCES: dict[str, Tolerance] = {
    "copied": Tolerance(1e-12, 1e-12, _ONE, "The same numbers, except for rounding in a unit conversion."),
    "model.a": Tolerance(
        1e-7,
        5e-12,
        "scale of the row's state over that of the column's, `[model.tensor_product]`",
        "The last function kept has a relative singular value of 1e-9: processors that round differently agree on its "
        "direction to 1e-7, and on vertices to 1e-8. They are rounded to 1e-12 of their size, which "
        "makes entries zero that are zero in the physical model.",
    ),
    "model.b": Tolerance(
        1e-7, 5e-12, "scale of the row's state over that of the input, `[model.tensor_product]`", "As model.a."
    ),
    "weights": Tolerance(
        1e-6,
        4e-8,
        _ONE,
        "As model.a; the weights depend on that direction directly: 1.3e-8 between processors. The smallest nonzero "
        "weight is 7e-6.",
    ),
    "sums": Tolerance(1e-9, 1e-9, _ONE, "Weights of a point sum to one."),
    "feedback gain": Tolerance(1e-9, 1e-12, _GAIN, "M N^-1, with N scaled to a unit diagonal."),
    "nominal gains": Tolerance(1e-8, 1e-11, _GAIN, "Y Q^-1, with Q scaled to a unit diagonal."),
    "ellipsoids": Tolerance(
        1e-6, 1e-10, _DIAGONAL, "Q^-1, with Q scaled to a unit diagonal; its smallest entries cancel."
    ),
    "relaxed bounds": Tolerance(
        1e-7, 1e-9, _ONE, "A copy of the inputs' (baseline), or (52) recomputed from two sets (adjustable)."
    ),
    "centre": Tolerance(1e-9, 1e-9, "half-width of the set", "A copy of the certificate's."),
    "half-widths": Tolerance(1e-9, 1e-12, "half-width of the set", "Roots of quadratic forms of Q."),
    "plans": Tolerance(1e-9, 1e-9, "range of the certified plans", "Sums of tightened bounds and nominal inputs."),
    "tightened bounds": Tolerance(1e-9, 1e-12, _ONE, "Limits of the inputs minus half-ranges of the feedback."),
    "disturbance bounds": Tolerance(1e-9, 1e-12, _ONE, "Measured values, inflated."),
    "eigenvalues": Tolerance(
        1e-6,
        1e-9,
        _ONE,
        "Eigenvalues of symmetric matrices scaled to a unit diagonal, through factors of condition 1e5.",
    ),
    "singular values": Tolerance(1e-6, 1e-12, _ONE, "Relative to the largest; the smallest are rounding."),
    "accuracy": Tolerance(0.05, 1e-12, _ONE, "Differences between nearly equal models, close to rounding."),
    "spectral radii": Tolerance(1e-8, 1e-8, _ONE, "Eigenvalues of matrices that are far from normal."),
    "certified costs": Tolerance(1e-6, 1e-12, _ONE, "A largest eigenvalue, through two Cholesky factors."),
    "rightmost poles": Tolerance(1e-6, 1e-6, _ONE, "Logarithms of eigenvalues near 1, over a period."),
    "room of plans": Tolerance(1e-6, 1e-9, _ONE, "Differences of tightened bounds and nominal inputs."),
    "inequalities": Tolerance(
        0.0, 1e-9, _ONE, "Inequality (34) and weights, which are zero by construction; all others hold with a margin."
    ),
    "flights": Tolerance(
        1e-5, 1e-12, _ONE, "Differences of states over a period: rounding of an altitude is 1e-6 of its channel."
    ),
    "random sequences": Tolerance(1e-6, 1e-12, _ONE, "Levels after 600 contracting steps."),
}
"""Tolerances by the quantity compared."""

RECOMPUTED_DESIGN = 1e-3
"""Largest deviation, in scaled coordinates, of a recomputed design."""

PARAMETERS = {
    "period": "copied",
    "notch.zero_frequency": "copied",
    "notch.zero_damping": "copied",
    "notch.pole_frequency": "copied",
    "notch.pole_damping": "copied",
    "model.a": "model.a",
    "model.b": "model.b",
    "scheduling.altitude.breakpoints": "copied",
    "scheduling.altitude.weights": "weights",
    "scheduling.velocity.breakpoints": "copied",
    "scheduling.velocity.weights": "weights",
    "feedback.gain": "feedback gain",
    "feedback.tau": "copied",
    "feedback.tau_minimum": "copied",
    "nominal.gains": "nominal gains",
    "nominal.ellipsoids": "ellipsoids",
    "nominal.state_scale": "copied",
    "nominal.input_scale": "copied",
    "nominal.input_bound": "relaxed bounds",
    "input.minimum": "copied",
    "input.maximum": "copied",
    "tube.centre": "centre",
    "tube.shape": "ellipsoids",
    "tube.half_width": "half-widths",
    "nominal.input_minimum": "plans",
    "nominal.input_maximum": "plans",
    "nominal.region_minimum": "plans",
    "nominal.region_maximum": "plans",
}
"""The tolerance of every number of a design file."""


ROUNDING = TOLERANCES["inequalities"].absolute
"""Amount by which an inequality that is zero by construction may appear to be violated."""


def entry_size(parameter: str, certificate: Mapping[str, Any]) -> np.ndarray:
    """Return what counts as one for each entry of ``parameter``, an array that its own broadcasts to, SI.

    Raises:
        KeyError: A field that the certificate lacks.
    """
    kind = PARAMETERS[parameter]
    if parameter.startswith("model.") or kind in ("feedback gain", "nominal gains"):
        table = certificate["inputs"]["model"]["tensor_product"]
        states = np.array([table["state_scale"][name] for name in STATE_NAMES])
        inputs = np.array([table["input_scale"][name] for name in INPUT_NAMES])
        rows, columns = {"model.a": (states, states), "model.b": (states, inputs)}.get(parameter, (inputs, states))
        # A certificate may have any scales.
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(rows[:, None] / columns)
    described = certificate["tube"]["invariant_set"]
    seen = sum(not name.startswith(INPUT_NAMES) for name in described["states"])
    if kind == "ellipsoids":
        Q = np.array([gain["Q"] for gain in certificate["nominal"]])
        if parameter == "tube.shape":
            Q = np.array(described["Q"])[:seen, :seen]
        P = np.linalg.inv(Q)
        roots = np.sqrt(np.diagonal(P, axis1=-2, axis2=-1))
        return np.asarray(roots[..., :, None] * roots[..., None, :])
    if kind in ("centre", "half-widths"):
        return np.array(described["half_width"])[:seen]
    if kind == "plans":
        plan = certificate["tube"]["tightening"]["plan"]
        low, high = plan["pitch_acceleration"]
        ranges = np.append(np.subtract(plan["highest"], plan["lowest"]), high - low)
        return ranges if "region" in parameter else ranges[: len(INPUT_NAMES)]
    return np.ones(1)


def page() -> str:
    """Return the table as a page."""
    lines = [_HEADER]
    for kind, t in TOLERANCES.items():
        names = [f"`{name}`" for name, its in PARAMETERS.items() if its == kind]
        entries = f"{kind}: {', '.join(names)}" if names else kind
        lines.append(f"| {entries} | {t.relative:g} | {t.absolute:g} | {t.size} | {t.reason} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")

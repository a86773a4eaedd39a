"""Tolerances of the entries of a design and of its certificate; ``docs/tolerances.md`` gives the reasons."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from hsv.model.signals import INPUT_NAMES


class Tolerance(NamedTuple):
    """Largest permitted difference of an entry from its recomputed value: the larger of two bounds.

    The bounds are ``relative`` times the magnitude of the recomputed entry, and ``absolute`` times the typical
    magnitude of such an entry, see :func:`entry_size`. The second decides for entries that are zero, exactly or except
    for rounding.
    """

    relative: float
    absolute: float

    def allowed(self, expected: np.ndarray, size: Any = 1.0) -> np.ndarray:
        """Return the largest permitted differences from ``expected``, entries of typical magnitude ``size``; SI."""
        return np.maximum(self.relative * np.abs(expected), self.absolute * np.asarray(size, float))


TOLERANCES = {
    "copied": Tolerance(1e-12, 1e-12),
    "model.a": Tolerance(1e-07, 5e-11),
    "model.b": Tolerance(1e-07, 5e-11),
    "weights": Tolerance(1e-06, 4e-08),
    "sums": Tolerance(1e-09, 1e-09),
    "feedback gain": Tolerance(1e-09, 1e-12),
    "nominal gains": Tolerance(1e-08, 1e-11),
    "ellipsoids": Tolerance(1e-06, 1e-10),
    "relaxed bounds": Tolerance(1e-07, 1e-09),
    "centre": Tolerance(1e-09, 1e-09),
    "half-widths": Tolerance(1e-09, 1e-12),
    "plans": Tolerance(1e-09, 1e-09),
    "tightened bounds": Tolerance(1e-09, 1e-12),
    "disturbance bounds": Tolerance(1e-09, 1e-12),
    "eigenvalues": Tolerance(1e-06, 1e-09),
    "singular values": Tolerance(1e-06, 1e-12),
    "accuracy": Tolerance(0.05, 1e-12),
    "spectral radii": Tolerance(1e-08, 1e-08),
    "certified costs": Tolerance(1e-06, 1e-12),
    "rightmost poles": Tolerance(1e-06, 1e-06),
    "room of plans": Tolerance(1e-06, 1e-09),
    "inequalities": Tolerance(0.0, 1e-09),
    "flights": Tolerance(1e-05, 1e-12),
    "disk margins": Tolerance(5e-06, 1e-12),
    "frequencies of margins": Tolerance(1e-03, 1e-12),
}
"""Tolerances by kind of quantity."""

RECOMPUTED_DESIGN = 1e-3
"""Largest deviation of a recomputed design from the shipped one, relative to an entry or, if larger, its size."""

PARAMETERS = {
    name: kind
    for kind, names in {
        "copied": "period notch.zero_frequency notch.zero_damping notch.pole_frequency notch.pole_damping "
        "scheduling.altitude.breakpoints scheduling.velocity.breakpoints feedback.tau feedback.tau_minimum tube.rates "
        "nominal.state_scale nominal.input_scale input.minimum input.maximum",
        "model.a": "model.a",
        "model.b": "model.b",
        "weights": "scheduling.altitude.weights scheduling.velocity.weights",
        "feedback gain": "feedback.gain",
        "nominal gains": "nominal.gains",
        "ellipsoids": "nominal.ellipsoids tube.shape",
        "relaxed bounds": "nominal.input_bound",
        "centre": "tube.centre",
        "half-widths": "tube.half_width",
        "plans": "nominal.input_minimum nominal.input_maximum nominal.region_minimum nominal.region_maximum",
    }.items()
    for name in names.split()
}
"""Kind of tolerance, a key of :data:`TOLERANCES`, for each numeric parameter of a design file."""


STATE_SIZES = np.array([200.0, 75.0, 0.02, 0.02, 0.05, 0.6, 10.0, 0.6, 12.0])
INPUT_SIZES = np.array([0.25, 0.1])
"""Typical deviations of the nine states and of the two inputs in a flight, SI."""

ACCURACY = {"relative_frobenius_error": 1e-2, "bode_magnitude_error_db": 0.5, "bode_phase_error_deg": 3.0}
"""Largest permitted errors of a polytopic model between the points from which it was computed."""

ROUNDING = TOLERANCES["inequalities"].absolute
"""Amount by which rounding may violate an inequality that holds with equality by construction."""


def entry_size(parameter: str, certificate: Mapping[str, Any]) -> np.ndarray:
    """Return the typical magnitude (SI) of each entry of a design ``parameter``, broadcastable to its array.

    Raises:
        KeyError: The certificate lacks a field that gives the magnitude.
    """
    kind = PARAMETERS[parameter]
    if parameter.startswith("model.") or kind in ("feedback gain", "nominal gains"):
        states, inputs = STATE_SIZES, INPUT_SIZES
        rows, columns = {"model.a": (states, states), "model.b": (states, inputs)}.get(parameter, (inputs, states))
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
        ranges = np.subtract(plan["highest"], plan["lowest"])
        return ranges if "region" in parameter else ranges[: len(INPUT_NAMES)]
    return np.ones(1)

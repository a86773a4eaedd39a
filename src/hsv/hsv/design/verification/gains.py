"""Checks of the gains: F = M N^-1 with (24), K = Y Q^-1 with (33)-(35)."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.nominal_gain import NominalProblem, certified_cost, decrease_between, step_deviation
from hsv.control.nominal_law import MEMBERSHIP_TOLERANCE, FamilyLaw
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.optimisation import smallest_eigenvalues, spectral_radii
from hsv.design.lyapunov import lyapunov_residuals
from hsv.design.verification.checks import Check, Subject, above, at_most, inverse, required, same, same_parameter
from hsv.design.verification.tolerances import ROUNDING
from hsv.model.signals import INPUT_NAMES, N_RIGID, N_STATES, STATE_NAMES

_POINTS, _SEED = 100, 11
"""Points of the boundary of an ellipsoid where an interpolated input is compared on both sides, and their seed."""

_BESIDE, _JUMP = 1e-9, 1e-4
"""Relative distance from the boundary, and the fraction of its bound by which the input may differ there."""


def feedback_checks(subject: Subject) -> Iterable[Check]:
    """Recompute F, the eigenvalues of (24) and the spectral radii."""
    design, stored = subject.design, subject.certificate["feedback"]
    A, B, F = design.polytope.A, design.polytope.B, design.feedback_gain
    N = np.array(stored["N"])
    yield same_parameter(subject, "feedback.gain", F, _quotient(np.array(stored["M"]), N), "feedback.gain = M N^-1")
    rigid = A[:, :N_RIGID, :N_RIGID] + B[:, :N_RIGID] @ F[:, :N_RIGID]
    residuals = lyapunov_residuals(rigid, N, "feedback gain F, LMI (24)")
    yield required(above("(24) smallest eigenvalue", residuals.min(), 0.0))
    yield same("(24) eigenvalues as certified", residuals, stored["lmi_smallest_eigenvalues"], "eigenvalues")
    radii = stored["spectral_radii"]
    yield same("spectral radii of A + BF as certified", spectral_radii(rigid), radii, "spectral radii")
    yield required(at_most("spectral radius of A + BF, all states", spectral_radii(A + B @ F).max(), 1.0 - 1e-6))


def nominal_checks(subject: Subject) -> Iterable[Check]:
    """Recompute every K and its inequalities."""
    design, inputs = subject.design, subject.certificate["inputs"]["nominal"]
    A, B = design.polytope.A, design.polytope.B
    problem = NominalProblem(
        A[:, :N_RIGID, :N_RIGID],
        B[:, :N_RIGID],
        design.period,
        _sizes(inputs["state_scale"], STATE_NAMES[:N_RIGID]),
        _sizes(inputs["input_scale"], INPUT_NAMES),
        input_bound(subject),
    )
    yield same_parameter(subject, "nominal.state_scale", design.nominal_state_scale, problem.state_scale)
    yield same_parameter(subject, "nominal.input_scale", design.nominal_input_scale, problem.input_scale)
    yield same_parameter(subject, "nominal.input_bound", design.nominal_input_bound, problem.input_bound)
    stored = subject.certificate["nominal"]
    sizes = [float(len(design.nominal_gains)), float(len(design.nominal_ellipsoids))]
    yield same("number of nominal gains and ellipsoids", sizes, [float(len(inputs["scales"]))] * 2, "copied")
    points = [(inputs[point]["altitude"], inputs[point]["velocity"]) for point in ("start", "target")]
    start = step_deviation(subject.vehicle.decoupled, points[0], points[1])
    ellipsoids = [np.array(one["Q"]) for one in stored]
    for i, (one, Q, scale) in enumerate(zip(stored, ellipsoids, inputs["scales"], strict=True)):
        K = design.nominal_gains[i]
        quotient = _quotient(np.array(one["Y"]), Q)
        yield same_parameter(subject, "nominal.gains", K, quotient, f"nominal.gains[{i}] = Y Q^-1")
        P, name = design.nominal_ellipsoids[i], f"nominal.ellipsoids[{i}] = Q^-1"
        yield same_parameter(subject, "nominal.ellipsoids", P, inverse(Q), name, i)
        gamma, residuals = certified_cost(problem, K[:, :N_RIGID], Q, f"nominal gain {i}")
        yield same(f"certified cost of gain {i}", gamma, one["certified_gamma"], "certified costs")
        yield above(f"(34) smallest eigenvalue of gain {i}", residuals.min(), -ROUNDING)
        x = scale * start
        yield at_most(f"(33) level of the design state, gain {i}", float(x @ np.linalg.solve(Q, x)), 1.0)
        reach = np.einsum("ij,jk,ik->i", K[:, :N_RIGID], Q, K[:, :N_RIGID]) / problem.input_bound**2
        yield at_most(f"(35) largest squared input over its bound, gain {i}", reach.max(), 1.0)
        radius = spectral_radii(A + B @ K).max()
        yield required(at_most(f"spectral radius of A + BK, gain {i}", radius, 1.0 - 1e-6))
    for i, (outer, inner) in enumerate(pairwise(ellipsoids)):
        factor = np.linalg.inv(np.linalg.cholesky(outer))
        room = float(smallest_eigenvalues(np.eye(len(outer)) - factor @ inner @ factor.T))
        yield above(f"ellipsoid {i + 1} inside the one before", room, 0.0)
    interpolated = bool(inputs.get("interpolated"))
    yield required(
        Check("nominal.interpolated", str(design.interpolated), str(interpolated), design.interpolated == interpolated)
    )
    if design.interpolated:
        yield from _interpolation_checks(design, problem, stored, ellipsoids)


def _interpolation_checks(
    design: ControlDesign, problem: NominalProblem, stored: list[dict[str, Any]], ellipsoids: list[np.ndarray]
) -> Iterable[Check]:
    """Recompute what holds between two ellipsoids: the level decreases, inputs keep their bounds, and do not jump.

    The bounds follow from (35) at both ends, which is linear in gain and P; the flown function is asked nevertheless.
    """
    for i, outside in enumerate(ellipsoids[:-1], start=1):
        between = decrease_between(problem, design.nominal_gains[i][:, :N_RIGID], outside)
        name = f"decrease in ellipsoid {i - 1} under gain {i}"
        yield required(above(f"{name}, smallest eigenvalue", between.min(), 0.0))
        yield same(f"{name} as certified", between, stored[i]["between_smallest_eigenvalues"], "eigenvalues")
    law, draw = FamilyLaw(nominal_data(design)), np.random.default_rng(_SEED)
    largest, jump = 0.0, 0.0
    boundary = np.sqrt(1.0 + MEMBERSHIP_TOLERANCE)
    for Q in ellipsoids[1:]:
        directions = draw.normal(size=(_POINTS, N_RIGID))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        for x in boundary * directions @ np.linalg.cholesky(Q).T:
            inner, outer = (
                law.step(np.append((1.0 + side) * x, np.zeros(N_STATES - N_RIGID))).input / problem.input_bound
                for side in (-_BESIDE, _BESIDE)
            )
            largest = max(largest, float(np.abs(outer).max()))
            jump = max(jump, float(np.abs(outer - inner).max()))
    yield at_most("largest input between ellipsoids over its bound", largest, 1.0 + MEMBERSHIP_TOLERANCE)
    yield at_most("jump of the input at the boundary of an ellipsoid over its bound", jump, _JUMP)


def input_bound(subject: Subject) -> np.ndarray:
    """Return the bounds (2) of |u_n| that the nominal gains were sought with: the inputs', or relaxed (52)."""
    adjustable = subject.certificate.get("adjustable")
    if adjustable:
        return np.array(adjustable["input_bound"])
    return _sizes(subject.certificate["inputs"]["nominal"]["input_bound"], INPUT_NAMES)


def _sizes(table: dict[str, float], names: tuple[str, ...]) -> np.ndarray:
    return np.array([table[name] for name in names])


def _quotient(M: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Return the gain (2, 9) M N^-1, N scaled to a unit diagonal first; nothing acts on the flexible states."""
    scale = np.sqrt(np.diag(N))
    gain = np.zeros((len(M), N_STATES))
    gain[:, :N_RIGID] = np.linalg.solve(N / np.outer(scale, scale), (M / scale).T).T / scale
    return gain

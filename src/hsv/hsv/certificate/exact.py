"""Proofs in exact arithmetic: each inequality of a certificate is proved or refuted, without any tolerance.

A number of a file is the rational number that its binary value is; sums, products and quotients of rational numbers are
exact. A symmetric matrix is positive definite if and only if all pivots of its decomposition L D L' are positive, which
:func:`positive_definite` decides without fractions. An inequality between a half-width and a sum of square roots is
decided by :func:`roots_at_most`. The parts follow the paper: gain F (eq. 24), invariant set (eq. 25 to 28), tightened
bounds (eq. 30), adjustable factor (eq. 47, 48). :data:`UNPROVED` lists the statements that such a proof takes as given.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product
from math import isqrt, lcm

import numpy as np

from hsv.certificate.checks import Check, Checks, Subject
from hsv.certificate.verification import Tube, error_system, extreme_factors, lag_feedback
from hsv.control.design import ControlDesign
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES

UNPROVED = (
    "measured in flights: bounds of W, its channels in every flight, range of the nominal plan, feedback of the lag",
    "recomputed within a tolerance: vertices (eq. 12), their weights, gains K (eq. 31 to 35), set monitored in flight",
    "taken at their binary values: notch filter and actuators in discrete time, columns of the accelerations in W",
    "recomputed in floating point: bounds of the feedback at limited rates, from which tightened bounds follow",
    "not modelled: rounding in flight",
)
"""What the exact statements rest on: it is measured, or computed with rounding."""

rational = np.vectorize(Fraction, otypes=[object])
"""Return an array of the rational numbers (:class:`fractions.Fraction`) that the given floating-point numbers are."""

_ROWS = (*STATE_NAMES[:N_RIGID], *INPUT_NAMES)
"""Names of the outputs that star norms bound: the rigid states, and the feedback on the inputs."""


def positive_definite(S: np.ndarray) -> bool:
    """Return whether ``S`` (n, n), of rational numbers, is exactly symmetric and positive definite.

    With S scaled to integers, Bareiss' elimination computes its leading principal minors, which are the products of the
    pivots of L D L'; its divisions leave no remainder.
    """
    if np.any(S != S.T):
        return False
    common = lcm(*(entry.denominator for entry in S.flat))
    S, previous = np.array([[int(entry * common) for entry in row] for row in S], dtype=object), 1
    for k in range(len(S)):
        if S[k, k] <= 0:
            return False
        below = np.outer(S[k + 1 :, k], S[k, k + 1 :])
        S[k + 1 :, k + 1 :], previous = (S[k, k] * S[k + 1 :, k + 1 :] - below) // previous, S[k, k]
    return True


def invariant(A: np.ndarray, columns: np.ndarray, Q: np.ndarray, lam: Fraction, multipliers: np.ndarray) -> bool:
    """Return whether {v: v' Q^-1 v <= 1} is invariant under v+ = A v + columns d with |d_j| <= 1, for a positive Q.

    By the S-procedure it is if Q - A Q A' / lam - sum_j g_j g_j' / l_j is positive definite for multipliers l_j > 0 of
    sum 1 - lam. Those given are scaled to exactly this sum.
    """
    if not (0 < lam < 1 and min(multipliers) > 0):
        return False
    scaled = columns / multipliers * (sum(multipliers) / (1 - lam))
    return positive_definite(Q - A @ Q @ A.T / lam - scaled @ columns.T)


def inside(x: np.ndarray, Q: np.ndarray) -> bool:
    """Return whether x' Q^-1 x < 1, for a positive definite ``Q``."""
    return positive_definite(np.block([[np.array([[Fraction(1)]]), x[None]], [x[:, None], Q]]))


def roots_at_most(squares: Sequence[Fraction], limit: Fraction) -> bool:
    """Return whether the sum of the square roots of ``squares`` is at most ``limit``.

    Rational roots are subtracted from the limit. The sum of the others is irrational, so that enough binary digits of
    it decide.
    """
    irrational = []
    for square in squares:
        if square < 0:
            return False
        root = Fraction(isqrt(square.numerator), isqrt(square.denominator))
        if root * root == square:
            limit -= root
        else:
            irrational.append(square)
    if not irrational:
        return limit >= 0
    digits = 64
    while True:
        below = sum(isqrt(int(square * 4**digits)) for square in irrational)
        if below + len(irrational) <= limit * 2**digits:
            return True
        if below >= limit * 2**digits:
            return False
        digits *= 2


def exact_checks(subject: Subject) -> Checks:
    """Prove or refute the inequalities for F, for the invariant sets, and for the bounds that follow from them."""
    design, polytope = subject.design, subject.design.polytope
    A, B = rational(polytope.A[:, :N_RIGID, :N_RIGID]), rational(polytope.B[:, :N_RIGID])
    M, N, F = map(rational, (subject.stated("feedback.M"), subject.stated("feedback.N"), design.feedback_gain))
    yield _proof("feedback.N: symmetric and positive definite", [positive_definite(N)])
    blocks = (np.block([[N, image.T], [image, N]]) for image in A @ N + B @ M)
    yield _proof(f"(24) with M and N, at {len(A)} vertices", map(positive_definite, blocks))
    yield _decrease(f"(24) e' N^-1 e decreases under F as it flies, at {len(A)} vertices", A + B @ F[:, :N_RIGID], N)
    yield from _tube_proofs(subject, design, "tube")
    if "adjustable" not in subject.certificate:
        return
    effectiveness = subject.stated("inputs.disturbance.elevator_effectiveness")
    extremes = product(extreme_factors(design), (1.0, effectiveness))
    loops = [error_system(design, subject.vehicle, tau, share, rational).A for tau, share in extremes]
    N = rational(subject.stated("adjustable.lyapunov.N"))
    yield _proof("adjustable.lyapunov.N: symmetric and positive definite", [positive_definite(N)])
    yield _decrease("adjustable.lyapunov: decrease with and without fault, at both factors", np.concatenate(loops), N)
    one = np.ones(N_RIGID)
    yield from _tube_proofs(subject, replace(design, tau=one, tau_minimum=one), "adjustable.complete")
    yield from _tube_proofs(subject, design, "adjustable.incomplete")


def _tube_proofs(subject: Subject, design: ControlDesign, field: str) -> Checks:
    """Prove that the set under ``field`` of the certificate is invariant, contains e = 0, and keeps its bounds."""
    tube = Tube(subject, design, field, rational)
    loops = list(zip(tube.A, tube.columns, strict=True))
    yield _proof(f"{field}: Q symmetric and positive definite", [positive_definite(tube.Q)])
    kept = (invariant(*loop, tube.Q, Fraction(tube.lam), factors) for loop, factors in zip(loops, tube.l, strict=True))
    yield _proof(f"{field}: ellipsoid invariant (26) under {len(loops)} closed loops", kept)
    yield _proof(f"{field}: e = 0 inside the ellipsoid (25)", [inside(-tube.c, tube.Q)])
    parts: dict[int, np.ndarray] = {}
    if tube.star:
        parts = {j: rational(part) for j, part in Tube(subject, design, field).start_parts().items()}
        *others, last = parts
        parts[last] = -tube.c - sum(parts[j] for j in others)
        for name, Qs, lams in zip(_ROWS, tube.star.Q, tube.star.contraction, strict=True):
            kept = (
                positive_definite(Qs[j])
                and all(invariant(A, g[:, [j]], Qs[j], lams[j], 1 - lams[[j]]) for A, g in loops)
                for j in parts
            )
            yield _proof(f"{field}: star norms of {name}, {len(parts)} ellipsoids invariant", kept)
            starts = (inside(part, Qs[j]) for j, part in parts.items())
            yield _proof(f"{field}: star norms of {name}, e = 0 inside", starts)
    yield from _bound_proofs(subject, tube, list(parts))


def _bound_proofs(subject: Subject, tube: Tube, acting: Sequence[int]) -> Checks:
    """Prove half-widths (28) and tightened bounds (30) of ``tube``; star norms sum over the ``acting`` channels."""
    field, design, n, F_d = tube.field, tube.design, len(tube.c), tube.system.F_d
    stated = subject.stated(f"{field}.invariant_set")
    half_width, feedback = rational(stated["half_width"]), rational(stated["feedback_half_range"])
    rows = np.vstack((rational(np.eye(n)), tube.system.F))
    narrowed = [*range(N_RIGID), *range(n, len(rows))]

    def bounded(k: int, limit: Fraction) -> bool:
        """Return whether output ``k`` stays within ``limit`` of its centre in the ellipsoid, or by its star norms."""
        if roots_at_most([rows[k] @ tube.Q @ rows[k]], limit):
            return True
        star = tube.star.Q[narrowed.index(k)] if tube.star and k in narrowed else None
        return star is not None and roots_at_most([rows[k] @ star[j] @ rows[k] for j in acting], limit)

    yield _proof(f"{field}: half-widths (28)", map(bounded, range(len(rows)), [*half_width, *feedback]))
    ranges = [[subject.stated(f"{field}.tightening.{side}") for side in ("lower", "upper")]]
    lag: Sequence[Sequence[float]] = ((0.0, 0.0), (0.0, 0.0))
    if field == "tube":
        lag = lag_feedback(subject)
        flown = rational(design.tube.half_width if design.tube else [])
        yield _proof(f"{field}: half-widths as monitored in flight", map(bounded, range(len(flown)), flown))
        if design.plan_bounds is not None:
            ranges.append([design.plan_bounds.input_minimum, design.plan_bounds.input_maximum])
    if tube.rated is not None:
        feedback = np.minimum(feedback, tube.rated[N_RIGID:])
    middle, half = tube.system.F @ tube.c + F_d @ tube.middle, feedback + np.abs(F_d) @ tube.half
    least = rational(design.input_minimum) - middle + half - rational(lag[0])
    most = rational(design.input_maximum) - middle - half - rational(lag[1])
    kept = (bool(np.all(rational(low) >= least) and np.all(rational(high) <= most)) for low, high in ranges)
    yield _proof(f"{field}: tightened bounds (30), stated and as they fly", kept)


def _proof(statement: str, cases: Iterable[bool]) -> Check:
    """Return the required check that a ``statement`` holds in all ``cases``; it ends with the first that does not."""
    refuted = next((k for k, holds in enumerate(cases, 1) if not holds), None)
    found, expected = ("proved", "") if refuted is None else (f"refuted, case {refuted}", "proved in all cases")
    return Check(statement, found, expected, refuted is None, required=True)


def _decrease(statement: str, loops: np.ndarray, N: np.ndarray) -> Check:
    """Return the check that e' N^-1 e decreases in all ``loops`` (r, n, n), for a positive definite ``N`` (n, n)."""
    return _proof(statement, (positive_definite(N - A @ N @ A.T) for A in loops))

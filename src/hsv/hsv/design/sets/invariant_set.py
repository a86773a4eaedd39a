"""The tube's invariant set, in place of eq. 26: an ellipsoid {c + v: v' Q^-1 v <= 1}, which star norms may narrow.

At vertex i the next v is v+ = A_i v + G_i d with |d_j| <= 1; the last d_j is always 1, for the drift of the centre c.
By the S-procedure v stays inside if there are lam and l_j >= 0 with sum_j l_j <= 1 - lam and

    [lam Q, 0, Q A_i'; 0, diag(l), G_i'; A_i Q, G_i, Q] >= 0.

The ellipsoid is then also invariant for convex combinations of the vertices, because it is convex. For fixed lam the
inequality is linear in Q, l and c. The paper's set is a box (eq. 25 to eq. 28), which does not exist for this system;
see ``hsv_paper.claims.numbers.box``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import cholesky, solve_discrete_lyapunov, solve_triangular

from hsv.base.errors import DesignError
from hsv.certificate.convolution import LONGEST, rated_bounds
from hsv.control.design import ControlDesign, TubeSet
from hsv.design.sets.star_norms import StarNorms
from hsv.design.tube_problem import TubeProblem
from hsv.lmi.semidefinite import (
    MATRIX_DIGITS,
    Unknown,
    ellipsoid_norms,
    inverse,
    minimise,
    rounded_matrix,
    rounded_to_size,
)
from hsv.model.signals import N_RIGID

_INFLATION = 1.002
"""Factor on Q that keeps the set invariant if the gains change in their sixth digit."""

OUTWARD = 1.0 + 1e-12
"""Factor on half-widths and on the room for the feedback: after rounding they are still bounds in exact arithmetic."""


@dataclass(frozen=True)
class Rated:
    """Bounds for flights whose altitude and velocity change at most at ``rates`` (2), m/s and m/s^2.

    ``half_range`` (7): half-ranges of the output rows of :meth:`TubeProblem.output_rows`, SI; ``horizon`` (7): largest
    number of steps that each uses. See :mod:`hsv.certificate.convolution`.
    """

    rates: np.ndarray
    half_range: np.ndarray
    horizon: list[int]

    def as_dict(self) -> dict[str, Any]:
        """Return the bounds for JSON."""
        return {"rates": self.rates.tolist(), "half_range": self.half_range.tolist(), "horizon": self.horizon}


@dataclass(frozen=True)
class InvariantSet:
    """A set centre + Z that the error does not leave while the disturbances stay in W, with its evidence; SI.

    ``centre`` c (n), ``Q`` (n, n), ``contraction`` lam, ``multipliers`` l (r, d + 1). With ``star_norms`` the set is
    the ellipsoid's intersection with theirs; rigid states and feedback then have the smaller of the two half-widths.
    With ``rated``, the tightened bounds hold for flights at limited rates only; the set holds for any.
    """

    problem: TubeProblem
    centre: np.ndarray
    Q: np.ndarray
    contraction: float
    multipliers: np.ndarray
    star_norms: StarNorms | None = None
    rated: Rated | None = None

    def limited(self, design: ControlDesign, rates: np.ndarray) -> InvariantSet:
        """Return the set with bounds for flights of ``design`` at limited ``rates`` (2): m/s, m/s^2.

        Raises:
            DesignError: The design is adjustable, and its loops change with tau, too.
        """
        A, columns, rows = self.problem.system.A, self.problem.columns(self.centre), self.problem.output_rows()
        if len(A) != len(design.polytope.A):
            raise DesignError("invariant_set.rates: expected a design that is not adjustable")
        stacks = [[self.Q[None]] for _ in rows]
        if self.star_norms:
            acting = columns.any(axis=(0, 1))
            stacks = [[*stack, Q[acting]] for stack, Q in zip(stacks, self.star_norms.Q, strict=True)]
        loops, changes = np.concatenate((A, columns), axis=2), rates * design.period
        tried = [LONGEST] * len(rows)
        half_range, horizon = rated_bounds(design.polytope, loops, self.centre, rows, stacks, changes, tried)
        return replace(self, rated=Rated(rates, OUTWARD * half_range, horizon))

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths z (n) of Z (paper eq. 28)."""
        return OUTWARD * self._bounds(np.sqrt(np.diag(self.Q)), slice(N_RIGID))

    @property
    def feedback(self) -> np.ndarray:
        """Half-range of the feedback F e over Z, for each input."""
        F = self.problem.system.F
        return OUTWARD * self._bounds(np.sqrt(np.einsum("ij,jk,ik->i", F, self.Q, F)), slice(N_RIGID, None))

    @property
    def input_range(self) -> np.ndarray:
        """Half-range of the feedback F e, for each input, that the tightened bounds leave free."""
        return np.minimum(self.feedback, self.rated.half_range[N_RIGID:]) if self.rated else self.feedback

    def _bounds(self, bounds: np.ndarray, rows: slice) -> np.ndarray:
        if self.star_norms:
            narrower = self.star_norms.bounds(self.problem)[rows]
            bounds[: len(narrower)] = np.minimum(bounds[: len(narrower)], narrower)
        return bounds

    def seen(self) -> TubeSet:
        """Return the set's projection on the states that the controller knows: rigid states and notch filter."""
        n = self.problem.system.seen
        rates = self.rated.rates if self.rated else np.empty(0)
        return TubeSet(self.centre[:n], inverse(self.Q[:n, :n]), self.half_width[:n], rates)

    def levels(self, error: np.ndarray) -> np.ndarray:
        """Return the level (e - c)' Q^-1 (e - c) of each error (..., n): at most 1 inside the ellipsoid."""
        v = error - self.centre
        return np.asarray(np.einsum("...i,ij,...j->...", v, inverse(self.Q), v))

    def residuals(self) -> np.ndarray:
        """Return the margin (r) of the module's inequality at each vertex, in place of eq. 27; above zero: it holds.

        It is the smallest eigenvalue of I - M M', the inequality's Schur complement with Q = L L' scaled to I, where
        M = L^-1 [A L / sqrt(lam), G / sqrt(l)].
        """
        columns = self.problem.columns(self.centre) / np.sqrt(self.multipliers)[:, None, :]
        return (
            1.0
            - ellipsoid_norms(self.Q, "ellipsoid: Q", self.problem.system.A / np.sqrt(self.contraction), columns) ** 2
        )

    def certify(self) -> dict[str, Any]:
        """Recompute that the set is invariant at every vertex and return the evidence, for JSON.

        Raises:
            DesignError: The set is not invariant, or it does not contain e = 0, where flights start.
        """
        sums = self.multipliers.sum(axis=1).max()
        if not (self.multipliers.min() > 0.0 and sums <= (1.0 - self.contraction) * (1.0 + 1e-12)):
            raise DesignError("ellipsoid: multipliers: expected all above zero, sums of at most 1 - contraction")
        residuals, origin = self.residuals(), float(self.levels(np.zeros(len(self.Q))))
        worst = int(np.argmin(residuals))
        if not residuals[worst] > 0.0:
            raise DesignError(f"ellipsoid: inequality at vertex {worst} = {residuals[worst]:.3g}, expected above zero")
        if not origin <= 1.0:
            raise DesignError(f"ellipsoid: level of e = 0 is {origin:.6g}, expected at most 1: flights start there")
        evidence: dict[str, Any] = {"lmi_smallest_eigenvalues": residuals.tolist(), "level_of_zero_error": origin}
        if self.star_norms:
            evidence["star_norms"] = self.star_norms.certify(self.problem, self.centre)
        return evidence

    def report(self) -> dict[str, Any]:
        """Return the set as a part of a certificate, for JSON."""
        star: dict[str, Any] = {"star_norms": self.star_norms.as_dict()} if self.star_norms else {}
        if self.rated:
            star["rated"] = self.rated.as_dict()
        return {
            "kind": "ellipsoid",
            "states": list(self.problem.system.names),
            "centre": self.centre.tolist(),
            "half_width": self.half_width.tolist(),
            "feedback_half_range": self.feedback.tolist(),
            "Q": self.Q.tolist(),
            "contraction": self.contraction,
            "multipliers": self.multipliers.tolist(),
            **star,
        }

    @classmethod
    def from_report(cls, problem: TubeProblem, report: Mapping[str, Any]) -> InvariantSet:
        """Return the set that :meth:`report` wrote.

        Raises:
            DesignError: The set is not an ellipsoid, or its star norms do not match ``problem``.
        """
        if report["kind"] != "ellipsoid":
            raise DesignError(f"invariant set of kind {report['kind']!r}: expected an ellipsoid")
        centre, Q, multipliers = (np.array(report[name]) for name in ("centre", "Q", "multipliers"))
        star = StarNorms.from_report(report["star_norms"], problem) if "star_norms" in report else None
        rated = None
        if "rated" in report:
            rates, half_range, horizon = (report["rated"][name] for name in ("rates", "half_range", "horizon"))
            rated = Rated(np.array(rates), np.array(half_range), horizon)
        return cls(problem, centre, Q, report["contraction"], multipliers, star, rated)


def ellipsoid(
    problem: TubeProblem, state_scale: np.ndarray, input_scale: np.ndarray, contractions: list[float]
) -> InvariantSet:
    """Return the ellipsoid with the least sum of squares of scaled half-widths and feedback, in place of paper eq. 26.

    Args:
        problem: Error system and disturbances.
        state_scale: Half-widths of the five rigid states that weigh equally, SI.
        input_scale: Half-ranges of the feedback on the two inputs that weigh as much, SI.
        contractions: Values of lam to try; the best ellipsoid of all is returned.

    Raises:
        DesignError: For no lam is there a solution that passes when recomputed.
    """
    weight = np.zeros((len(problem.system.A[0]), len(state_scale) + len(input_scale)))
    weight[: len(state_scale), : len(state_scale)] = np.diag(1.0 / state_scale)
    weight[:, len(state_scale) :] = (problem.system.F / input_scale[:, None]).T
    best: InvariantSet | None = None
    failure: DesignError | None = None
    for contraction in contractions:
        try:
            found = _solve(problem, weight, contraction)
            found.certify()
        except DesignError as error:
            failure = error
            continue
        if best is None or np.sum((weight.T @ found.Q) * weight.T) < np.sum((weight.T @ best.Q) * weight.T):
            best = found
    if best is None:
        raise DesignError(f"ellipsoid: none for any contraction of {contractions}: {failure}")
    return best


def _solve(problem: TubeProblem, weight: np.ndarray, contraction: float) -> InvariantSet:
    A0 = problem.system.A.mean(axis=0)
    guess = problem.centre()
    G0 = problem.columns(guess)
    gramian = solve_discrete_lyapunov(A0, np.mean(G0 @ np.swapaxes(G0, 1, 2), axis=0))
    T = cholesky(0.5 * (gramian + gramian.T), lower=True)
    inverse = solve_triangular(T, np.eye(len(T)), lower=True)
    A = inverse @ problem.system.A @ T
    G = inverse @ G0
    r, n, d = G.shape
    weighted = weight.T @ T

    def inequalities(Q: np.ndarray, shift: np.ndarray, multipliers: np.ndarray) -> list[np.ndarray]:
        blocks = [np.diag(1.0 - contraction - multipliers.sum(axis=1))]
        for A_i, G_i, l_i in zip(A, G, multipliers, strict=True):
            drift = G_i[:, -1:] + (A_i - np.eye(n)) @ shift
            columns = np.hstack((G_i[:, :-1], drift))
            AQ = A_i @ Q
            rows = [
                [contraction * Q, np.zeros((n, d)), AQ.T],
                [np.zeros((d, n)), np.diag(l_i), columns.T],
                [AQ, columns, Q],
            ]
            blocks.append(np.block(rows))
        return blocks

    Q, shift, multipliers = minimise(
        (Unknown((n, n), symmetric=True), Unknown((n, 1)), Unknown((r, d))),
        lambda Q, shift, multipliers: float(np.trace(weighted @ Q @ weighted.T)),
        inequalities,
        f"ellipsoid, contraction {contraction}",
    )
    Q_si = rounded_matrix(_INFLATION * T @ Q @ T.T)
    centre = rounded_to_size(guess + T @ shift[:, 0], np.sqrt(np.diag(Q_si)), MATRIX_DIGITS)
    multipliers = rounded_to_size(multipliers, 1.0 - contraction, MATRIX_DIGITS)
    return InvariantSet(problem, centre, Q_si, contraction, multipliers)

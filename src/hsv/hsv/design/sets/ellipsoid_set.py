"""The recentred ellipsoid {c + v: v' Q^-1 v <= 1} by the S-procedure over all vertices: the certified default.

At vertex i, v+ = A_i v + G_i d with |d_j| <= 1 (and one more constant d, the drift of the centre) stays inside if there
are lam and l_j >= 0, sum l_j <= 1 - lam, with

    [lam Q, 0, Q A_i'; 0, diag(l), G_i'; A_i Q, G_i, Q] >= 0.

Convex combinations of vertices follow, because the set is convex. For fixed lam this is linear in Q, l and c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import TubeSet
from hsv.control.optimisation import SolverReport, smallest_eigenvalues
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem
from hsv.design.sets.star_norms import StarNorms
from hsv.model.signals import N_RIGID


@dataclass(frozen=True)
class EllipsoidSet(InvariantSet):
    """The set with what certifies it: ``Q`` (n, n), ``contraction`` lam, ``multipliers`` l (r, d + 1).

    With ``star_norms`` it is the intersection with their sums, and half-widths and feedback are the lesser ones.
    """

    Q: np.ndarray
    contraction: float
    multipliers: np.ndarray
    solver: SolverReport
    star_norms: StarNorms | None = None

    kind = "ellipsoid"

    @property
    def shape(self) -> np.ndarray:
        """P = Q^-1 (n, n)."""
        return _inverse(self.Q)

    def seen(self) -> TubeSet:
        """Return the set as a controller sees it: its shadow on the states before those of actuators, if it has any."""
        n = self.problem.system.seen
        return TubeSet(self.centre[:n], _inverse(self.Q[:n, :n]), self.half_width[:n])

    def level(self, error: np.ndarray) -> np.ndarray:
        """Return (e - c)' P (e - c) of errors (..., n)."""
        v = error - self.centre
        return np.asarray(np.einsum("...i,ij,...j->...", v, self.shape, v))

    def certify(self) -> dict[str, Any]:
        """Recompute the inequality at every vertex, in coordinates where Q is the identity."""
        residuals = vertex_residuals(self.problem, self.centre, self.Q, self.contraction, self.multipliers)
        origin = float(self.level(np.zeros(len(self.Q))))
        worst = int(np.argmin(residuals))
        if not residuals[worst] > 0.0:
            raise DesignError(f"ellipsoid: inequality at vertex {worst} = {residuals[worst]:.3g}, expected above zero")
        if not origin <= 1.0:
            raise DesignError(f"ellipsoid: level of e = 0 is {origin:.6g}, expected at most 1: flights start there")
        evidence: dict[str, Any] = {"lmi_smallest_eigenvalues": residuals.tolist(), "level_of_zero_error": origin}
        if self.star_norms:
            evidence["star_norms"] = self.star_norms.certify(self.problem, self.centre)
        return evidence

    def narrowed(self, star_norms: StarNorms) -> EllipsoidSet:
        """Return the intersection with the sums of ``star_norms``."""
        bounds = star_norms.bounds(self.problem)
        half_width = self.half_width.copy()
        half_width[:N_RIGID] = np.minimum(half_width[:N_RIGID], bounds[:N_RIGID])
        feedback = np.minimum(self.feedback, bounds[N_RIGID:])
        return replace(self, half_width=half_width, feedback=feedback, star_norms=star_norms)


def _inverse(Q: np.ndarray) -> np.ndarray:
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


def from_shape(
    problem: TubeProblem,
    centre: np.ndarray,
    Q: np.ndarray,
    contraction: float,
    multipliers: np.ndarray,
    solver: SolverReport,
) -> EllipsoidSet:
    """Return the set with its outer box and feedback range computed from ``Q``."""
    F = problem.system.F
    feedback = np.sqrt(np.einsum("ij,jk,ik->i", F, Q, F))
    return EllipsoidSet(problem, centre, np.sqrt(np.diag(Q)), feedback, Q, contraction, multipliers, solver)


def from_report(problem: TubeProblem, report: Mapping[str, Any]) -> EllipsoidSet:
    """Return the set that ``report``, the invariant set in a certificate, describes for ``problem``.

    Raises:
        DesignError: Star norms that are not those of such a problem.
    """
    found = from_shape(
        problem,
        np.array(report["centre"]),
        np.array(report["Q"]),
        report["contraction"],
        np.array(report["multipliers"]),
        SolverReport(**report["solver"], time=0.0),
    )
    stored = report.get("star_norms")
    return found if stored is None else found.narrowed(StarNorms.from_report(stored, problem))


def vertex_residuals(
    problem: TubeProblem, centre: np.ndarray, Q: np.ndarray, contraction: float, multipliers: np.ndarray
) -> np.ndarray:
    """Return the smallest eigenvalue (r) of the inequality at each vertex; above zero: invariant.

    By its Schur complement, with Q and the diagonal scaled to the identity.

    Raises:
        DesignError: Q is not symmetric or not positive definite, or multipliers that are negative or sum to more than
            1 - lam.
    """
    if not np.array_equal(Q, Q.T):
        raise DesignError("ellipsoid: Q is not symmetric")
    try:
        factor = np.linalg.cholesky(Q)
    except np.linalg.LinAlgError as error:
        raise DesignError("ellipsoid: Q is not positive definite") from error
    if multipliers.min() < 0.0 or multipliers.sum(axis=1).max() > (1.0 - contraction) * (1.0 + 1e-12):
        raise DesignError("ellipsoid: multipliers: expected none negative and sums of at most 1 - contraction")
    A = np.linalg.solve(factor, problem.system.A @ factor)
    G = np.linalg.solve(factor, problem.columns(centre))
    r, n, d = G.shape
    # Multiplying out the last block row: M = diag(lam, l) - [A, G]' [A, G], scaled to a unit diagonal.
    AG = np.concatenate((A, G), axis=2)
    scale = np.concatenate((np.full((r, n), contraction), multipliers), axis=1)
    if scale.min() <= 0.0:
        raise DesignError("ellipsoid: multipliers: expected all above zero")
    root = 1.0 / np.sqrt(scale)
    M = np.eye(n + d) - root[:, :, None] * (np.swapaxes(AG, 1, 2) @ AG) * root[:, None, :]
    return smallest_eigenvalues(M)

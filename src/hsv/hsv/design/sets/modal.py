"""The box method in complex modal coordinates: e - c = V m with |m_j| <= zeta_j, V the eigenvectors of the mean vertex.

A modulus keeps nothing of a mode's phase and needs nothing of it: for the mean vertex |V^-1 A V| is diagonal with the
moduli of the eigenvalues, all below one, so the paper's condition |A_i| zeta + w_i <= zeta has solutions where it has
none in the given coordinates. With M the elementwise maximum over vertices, zeta = (I - M)^-1 max_i w_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.optimisation import spectral_radii
from hsv.design.sets.invariant_set import InvariantSet, TubeProblem


@dataclass(frozen=True)
class ModalSet(InvariantSet):
    """The set with its ``modes`` V (n, n, complex) and moduli ``bound`` zeta (n)."""

    modes: np.ndarray
    bound: np.ndarray

    kind = "modal"

    def level(self, error: np.ndarray) -> np.ndarray:
        """Return the largest ratio of a modal modulus to its bound, squared."""
        modal = np.abs((error - self.centre) @ np.linalg.inv(self.modes).T)
        return np.asarray(np.max(modal / self.bound, axis=-1) ** 2)

    def certify(self) -> dict[str, Any]:
        """Recompute |V^-1 A_i V| zeta + w_i <= zeta at every vertex."""
        A, w = _moduli(self.problem, self.centre, self.modes)
        residuals = ((self.bound - A @ self.bound - w) / self.bound).min(axis=1)
        if not residuals.min() >= 0.0:
            raise DesignError(f"modal box: vertex {int(np.argmin(residuals))} leaves the set by {-residuals.min():.3g}")
        return {"smallest_residuals": residuals.tolist()}


def modal_box(problem: TubeProblem) -> ModalSet:
    """Return the least box of modal moduli for the elementwise maximum over vertices.

    Raises:
        DesignError: The spectral radius of that maximum is not below one.
    """
    centre = problem.centre()
    modes = np.linalg.eig(problem.system.A.mean(axis=0))[1]
    A, w = _moduli(problem, centre, modes)
    largest = A.max(axis=0)
    radius = float(spectral_radii(largest[None])[0])
    if not radius < 1.0:
        raise DesignError(f"modal box: spectral radius of max |V^-1 A_i V| = {radius:.4f}, expected below 1")
    bound = np.linalg.solve(np.eye(len(w[0])) - largest, w.max(axis=0)) * (1.0 + 1e-9)
    F = problem.system.F
    return ModalSet(problem, centre, np.abs(modes) @ bound, np.abs(F @ modes) @ bound, modes, bound)


def _moduli(problem: TubeProblem, centre: np.ndarray, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    inverse = np.linalg.inv(modes)
    return np.abs(inverse @ problem.system.A @ modes), np.abs(inverse @ problem.columns(centre)).sum(axis=2)

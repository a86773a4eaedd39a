"""Linear matrix inequalities: how one was solved, and the eigenvalues by which it is rechecked."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class SolverReport:
    """Report on a solved problem: versions, ``status``, ``iterations``, ``time`` (s) and the ``objective`` returned."""

    solver: str
    modelling: str
    status: str
    iterations: int
    time: float
    objective: float

    def as_dict(self) -> dict[str, Any]:
        """Return the report for JSON, without the time, so that it is the same at every run."""
        return {name: value for name, value in asdict(self).items() if name != "time"}


def smallest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the smallest eigenvalue (r) of each symmetric matrix (r, k, k)."""
    return np.linalg.eigvalsh(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))[..., 0]


def spectral_radii(matrices: np.ndarray) -> np.ndarray:
    """Return the spectral radius (r) of each matrix (r, n, n)."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))

"""Solving semidefinite programmes reproducibly, with a status that is never taken on trust."""

from __future__ import annotations

import warnings
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import cvxpy as cp
import numpy as np

from hsv.errors import DesignError

_ACCEPTED = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)


@dataclass(frozen=True)
class SolverReport:
    """How a programme was solved: versions, ``status``, ``iterations``, ``time`` (s) and the ``objective`` claimed."""

    solver: str
    modelling: str
    status: str
    iterations: int
    time: float
    objective: float

    def as_dict(self) -> dict[str, Any]:
        """Return the report for JSON, without the time, so that it is the same at every run."""
        return {name: value for name, value in asdict(self).items() if name != "time"}


def solve(problem: cp.Problem, name: str) -> SolverReport:
    """Solve ``problem`` with Clarabel in one thread; the same input gives the same bits on the same machine.

    "optimal_inaccurate" passes here: every caller recomputes its inequalities from the returned matrices.

    Args:
        problem: The programme; its variables hold the solution afterwards.
        name: What is being designed, for the error message.

    Raises:
        DesignError: Infeasible, unbounded, or the solver gave up.
    """
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cp.CLARABEL, max_threads=1, direct_solve_method="qdldl")
    except cp.SolverError as error:
        raise DesignError(f"{name}: Clarabel found no solution ({error}), expected a feasible design") from error
    if problem.status not in _ACCEPTED:
        raise DesignError(f"{name}: status {problem.status!r}, expected one of {', '.join(_ACCEPTED)}")
    statistics = problem.solver_stats
    return SolverReport(
        solver=f"Clarabel {version('clarabel')}",
        modelling=f"cvxpy {version('cvxpy')}",
        status=str(problem.status),
        iterations=int(statistics.num_iters or 0),
        time=float(statistics.solve_time or 0.0),
        objective=float(problem.value),
    )


def smallest_eigenvalues(matrices: np.ndarray) -> np.ndarray:
    """Return the smallest eigenvalue (r) of each symmetric matrix (r, k, k)."""
    return np.linalg.eigvalsh(0.5 * (matrices + np.swapaxes(matrices, -1, -2)))[..., 0]


def spectral_radii(matrices: np.ndarray) -> np.ndarray:
    """Return the spectral radius (r) of each matrix (r, n, n)."""
    return np.asarray(np.abs(np.linalg.eigvals(matrices)).max(axis=-1))

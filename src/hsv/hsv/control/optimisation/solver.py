"""Solving semidefinite programmes reproducibly, with a status that is never taken on trust."""

from __future__ import annotations

import warnings
from importlib.metadata import version

import cvxpy as cp

from hsv.base.errors import DesignError
from hsv.control.optimisation.lmi import SolverReport

_ACCEPTED = (cp.OPTIMAL, cp.OPTIMAL_INACCURATE)


def solve(problem: cp.Problem, name: str) -> SolverReport:
    """Solve ``problem`` with Clarabel in one thread; the same input gives the same bits on the same machine.

    "optimal_inaccurate" passes here: every caller recomputes its inequalities from the returned matrices.

    Args:
        problem: The programme; its variables hold the solution afterwards.
        name: Name of the result, for the error message.

    Raises:
        DesignError: Infeasible, unbounded, or the solver gave up.
    """
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            problem.solve(solver=cp.CLARABEL, max_threads=1, direct_solve_method="qdldl")
    except cp.SolverError as error:
        raise DesignError(f"{name}: Clarabel found no solution, expected a feasible design") from error
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

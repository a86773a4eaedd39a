"""Rechecking a common Lyapunov function of all vertices (paper eq. 24)."""

from __future__ import annotations

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.optimisation import smallest_eigenvalues


def lyapunov_residuals(closed_loop: np.ndarray, N: np.ndarray, name: str) -> np.ndarray:
    """Return the smallest eigenvalue (r) of [N, (A_c N)'; A_c N, N] at each vertex, where N is scaled to the identity.

    Args:
        closed_loop: (r, n, n) A_i + B_i F.
        N: (n, n) the matrix of (24).
        name: Name of what is verified, for the error message.

    Raises:
        DesignError: N is not positive definite, or an eigenvalue is not positive.
    """
    try:
        factor = np.linalg.cholesky(N)
    except np.linalg.LinAlgError as error:
        raise DesignError(f"{name}: N = {N.tolist()}, expected a positive definite matrix") from error
    contraction = np.linalg.solve(factor, closed_loop @ factor)
    identity = np.broadcast_to(np.eye(len(N)), contraction.shape)
    blocks = np.block([[identity, np.swapaxes(contraction, 1, 2)], [contraction, identity]])
    residuals = smallest_eigenvalues(blocks)
    worst = int(np.argmin(residuals))
    if not residuals[worst] > 0.0:
        raise DesignError(
            f"{name}: smallest eigenvalue at vertex {worst} = {residuals[worst]:.3g}, expected above zero"
        )
    return residuals

"""The problem whose solution is an invariant set: an error system under bounded disturbances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem
from hsv.model.signals import N_RIGID


@dataclass(frozen=True)
class TubeProblem:
    """Error system and disturbances for which a set is sought.

    Vertices may change arbitrarily from step to step, and so may the disturbances within their bounds.
    """

    system: ErrorSystem
    disturbance: DisturbanceSet

    def centre(self) -> np.ndarray:
        """Return the equilibrium of the mean vertex under the mid-points of the disturbances (n)."""
        A, G = self.system.A.mean(axis=0), self.system.G.mean(axis=0)
        return np.linalg.solve(np.eye(len(A)) - A, G @ self.disturbance.centre)

    def columns(self, centre: np.ndarray) -> np.ndarray:
        """Return (r, n, d + 1) the effect of the disturbances at half their width on e - ``centre``.

        The last column is what each vertex moves the centre by under the mid-points: no choice of centre makes it
        vanish at all vertices.
        """
        A, G = self.system.A, self.system.G
        drift = A @ centre + G @ self.disturbance.centre - centre
        return np.concatenate((G * self.disturbance.half_width, drift[:, :, None]), axis=2)

    def output_rows(self) -> np.ndarray:
        """Return the rows (7, n) of the outputs that are bounded: the rigid states, and F of the two inputs."""
        return np.vstack((np.eye(N_RIGID, len(self.system.names)), self.system.F))


def mean_size(half_width: np.ndarray, state_scale: np.ndarray) -> float:
    """Return the geometric mean of the first half-widths over the ``state_scale`` (k) of their states."""
    return float(np.exp(np.mean(np.log(half_width[: len(state_scale)] / state_scale))))

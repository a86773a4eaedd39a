"""Interface of the invariant sets of the tube, however they were computed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem


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


@dataclass(frozen=True)
class InvariantSet(ABC):
    """A set centre + Z that the error never leaves, and its outer box.

    ``centre`` c (n); ``half_width`` z (n) of Z; ``feedback`` (2) the half-range of F e over Z; SI.
    """

    problem: TubeProblem
    centre: np.ndarray
    half_width: np.ndarray
    feedback: np.ndarray

    kind = ""

    @abstractmethod
    def level(self, error: np.ndarray) -> np.ndarray:
        """Return the level of errors e (..., n): at most 1 inside the set, larger outside."""

    @abstractmethod
    def certify(self) -> dict[str, Any]:
        """Recompute that the set is invariant at every vertex and return the evidence, for JSON.

        Raises:
            DesignError: It is not.
        """

    def size(self, state_scale: np.ndarray) -> float:
        """Return the geometric mean of the half-widths of the rigid states over ``state_scale`` (5)."""
        return mean_size(self.half_width, state_scale)


def mean_size(half_width: np.ndarray, state_scale: np.ndarray) -> float:
    """Return the geometric mean of the first half-widths over the ``state_scale`` (k) of their states."""
    return float(np.exp(np.mean(np.log(half_width[: len(state_scale)] / state_scale))))

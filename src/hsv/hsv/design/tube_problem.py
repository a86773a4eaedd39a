"""The problem whose solution is the invariant set of a design: its error system under its disturbances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.control.design import ControlDesign
from hsv.design.disturbance import ChannelModel, DisturbanceSet
from hsv.design.error_system import ErrorSystem, error_system, union
from hsv.model.signals import N_RIGID
from hsv.model.vehicle import Vehicle


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
        vanish at every vertex.
        """
        A, G = self.system.A, self.system.G
        drift = A @ centre + G @ self.disturbance.centre - centre
        return np.concatenate((G * self.disturbance.half_width, drift[:, :, None]), axis=2)

    def output_rows(self) -> np.ndarray:
        """Return the rows (7, n) of the outputs that are bounded: the rigid states, and F of the two inputs."""
        return np.vstack((np.eye(N_RIGID, len(self.system.names)), self.system.F))


def bounding_factors(design: ControlDesign) -> list[np.ndarray]:
    """Return the tube factors (5 each) that bound all others: the smallest, for which the set is found, and 1.

    The closed loop under a factor between the two lies between their closed loops, so that a set that is invariant
    under both is invariant for any variation of the factor between them.
    """
    one = np.ones(N_RIGID)
    return [one] if np.array_equal(design.tau_minimum, one) else [design.tau_minimum, one]


def tube_problem(design: ControlDesign, vehicle: Vehicle, disturbance: DisturbanceSet) -> TubeProblem:
    """Return the error system of ``design``, for all its factors, under ``disturbance``."""
    model, polytope = ChannelModel(design, vehicle), design.polytope
    gain = design.feedback_gain[:, :N_RIGID]
    systems = [
        error_system(
            polytope.A,
            polytope.B,
            gain * factor,
            model.notch,
            model.columns,
            design.actuator_sets,
            design.period,
        )
        for factor in bounding_factors(design)
    ]
    return TubeProblem(union(*systems), disturbance)

"""The problem that an invariant set solves: the error system of a design under its disturbance set."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.certificate.verification import extreme_factors
from hsv.control.design import ControlDesign
from hsv.design.disturbance import DisturbanceSet
from hsv.design.error_system import ErrorSystem, error_system, union
from hsv.flight.disturbance import ChannelModel
from hsv.model.signals import CHANNELS, N_RIGID
from hsv.model.vehicle import Vehicle


@dataclass(frozen=True)
class TubeProblem:
    """Error system and disturbance set for which an invariant set is sought.

    The vertex may change arbitrarily from step to step, and so may the disturbances within their bounds.
    """

    system: ErrorSystem
    disturbance: DisturbanceSet

    def centre(self) -> np.ndarray:
        """Return the equilibrium (n) of e at the mean vertex, with all disturbances at their mid-points."""
        A, G = self.system.A.mean(axis=0), self.system.G.mean(axis=0)
        return np.linalg.solve(np.eye(len(A)) - A, G @ self.disturbance.centre)

    def columns(self, centre: np.ndarray) -> np.ndarray:
        """Return the columns (r, n, d + 1) by which the disturbances, scaled to at most 1, act on e - ``centre``.

        The last column acts always: the drift of the centre in one step, with all disturbances at their mid-points. In
        general, no choice of the centre makes it zero at every vertex.
        """
        A, G = self.system.A, self.system.G
        drift = A @ centre + G @ self.disturbance.centre - centre
        return np.concatenate((G * self.disturbance.half_width, drift[:, :, None]), axis=2)

    def step_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds (5 each) of what W adds to the rigid states in a step, at any vertex.

        The channel that is known in flight, the plan's filtered pitch rate, is left out.
        """
        unknown = np.array([channel.name != "filtered_nominal_rate" for channel in CHANNELS])
        G = self.system.G[:, :N_RIGID] * unknown
        middle, reach = G @ self.disturbance.centre, np.abs(G) @ self.disturbance.half_width
        return (middle - reach).min(axis=0), (middle + reach).max(axis=0)

    def output_rows(self) -> np.ndarray:
        """Return the rows (7, n) of the bounded outputs of e: the five rigid states, then F e for both inputs."""
        return np.vstack((np.eye(N_RIGID, len(self.system.names)), self.system.F))


def tube_problem(design: ControlDesign, vehicle: Vehicle, disturbance: DisturbanceSet) -> TubeProblem:
    """Return the error system of ``design`` under ``disturbance``, with the vertices for all :func:`extreme_factors`.

    Its F is that for the smallest factor.
    """
    model, polytope = ChannelModel(design, vehicle), design.polytope
    gain = design.feedback_gain[:, :N_RIGID]
    systems = [
        error_system(
            polytope.A, polytope.B, gain * factor, model.notch, model.columns, design.actuator_sets, design.period
        )
        for factor in extreme_factors(design)
    ]
    return TubeProblem(union(*systems), disturbance)

"""The problem whose solution is the invariant set of a design: its error system under its disturbances."""

from __future__ import annotations

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.design.disturbance import ChannelModel, DisturbanceSet, acceleration_channels
from hsv.design.error_system import error_system, union
from hsv.design.sets.problem import TubeProblem
from hsv.model.actuators import ACTUATOR_SETS, ActuatorSet
from hsv.model.lpv.actuated import sampled_actuators
from hsv.model.signals import N_RIGID
from hsv.model.vehicle import Vehicle


def channel_model(design: ControlDesign, vehicle: Vehicle) -> ChannelModel:
    """Return how disturbances are measured against the model of ``design``, which is for ``vehicle``."""
    return ChannelModel(
        design.polytope,
        discretise(design.notch, design.period),
        acceleration_channels(vehicle, design.period),
        design.adjusted_gain(design.tau)[:, :N_RIGID],
        vehicle,
        design.filtered,
        sampled_actuators(known_actuators(design), design.period) if design.actuators else None,
    )


def known_actuators(design: ControlDesign) -> tuple[ActuatorSet, ...]:
    """Return the actuators that ``design`` knows."""
    return tuple(ACTUATOR_SETS[name] for name in design.actuators)


def bounding_factors(design: ControlDesign) -> list[np.ndarray]:
    """Return the tube factors (5 each) that bound all others: the smallest, for which the set is found, and 1.

    The closed loop under a factor between the two lies between their closed loops, so that a set that is invariant
    under both is invariant for any variation of the factor between them.
    """
    one = np.ones(N_RIGID)
    return [one] if np.array_equal(design.tau_minimum, one) else [design.tau_minimum, one]


def tube_problem(design: ControlDesign, vehicle: Vehicle, disturbance: DisturbanceSet) -> TubeProblem:
    """Return the error system of ``design``, for all its factors, under ``disturbance``."""
    model, polytope = channel_model(design, vehicle), design.polytope
    gain = design.feedback_gain[:, :N_RIGID]
    systems = [
        error_system(
            polytope.A,
            polytope.B,
            gain * factor,
            model.notch,
            model.columns,
            known_actuators(design),
            design.period,
        )
        for factor in bounding_factors(design)
    ]
    return TubeProblem(union(*systems), disturbance)

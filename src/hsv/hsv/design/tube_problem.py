"""What the invariant set of a design is sought for: its error system under its disturbances."""

from __future__ import annotations

from hsv.control.design_file import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.design.disturbance import ChannelModel, DisturbanceSet, acceleration_channels
from hsv.design.error_system import error_system
from hsv.design.sets.invariant_set import TubeProblem
from hsv.vehicle.parameters import vehicle_parameters


def channel_model(design: ControlDesign) -> ChannelModel:
    """Return how disturbances are measured against the model of ``design``."""
    columns = acceleration_channels(vehicle_parameters("decoupled"), design.period)
    return ChannelModel(design.polytope, discretise(design.notch, design.period), columns)


def tube_problem(design: ControlDesign, disturbance: DisturbanceSet) -> TubeProblem:
    """Return the error system of ``design`` under ``disturbance``."""
    model = channel_model(design)
    polytope = design.polytope
    return TubeProblem(
        error_system(polytope.A, polytope.B, design.feedback_gain, model.notch, model.columns), disturbance
    )

"""From flat parameters to the components of the loop: the one way, for simulation, checks and replay."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hsv.control.control_law import control_law
from hsv.control.design_file import find_design, read_design_parameters
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import NotchFilter
from hsv.faults.actuator import FaultInjector
from hsv.simulation.closed_loop import Components
from hsv.simulation.scenario import Scenario
from hsv.vehicle.plant import Plant


def flight_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the design's parameters with those of ``scenario`` over them.

    Raises:
        DesignError: Names the design's file and the parameter that is wrong.
    """
    return {**read_design_parameters(find_design(scenario.design)), **scenario.parameters()}


def assemble(values: Mapping[str, Any]) -> Components:
    """Return the five components that these parameters describe; each checks its own.

    Raises:
        ParameterError, DesignError, TrimError: Names the parameter that is wrong.
    """
    return Components(
        Plant.from_parameters(values),
        NotchFilter.from_parameters(values),
        NominalTrajectory.from_parameters(values),
        control_law(values),
        FaultInjector.from_parameters(values),
    )

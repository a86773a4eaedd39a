"""The loop flown by its component objects, one step at a time: what the nodes do, without their messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.closed_loop import Components, controller_input
from hsv.simulation.scenario import load_scenario
from hsv.vehicle.plant import FlightStatus


def components(scenario: str = "case1", **changes: Any) -> Components:
    """Return the parts of a shipped scenario's loop; changed parameters are written with __ for the dot."""
    changed = {name.replace("__", "."): value for name, value in changes.items()}
    return assemble(flight_parameters(load_scenario(scenario)) | changed)


def step_by_step(parts: Components) -> dict[str, np.ndarray]:
    """Fly ``parts`` to the end; return the histories (n + 1, ...) by the names of ``History``, and the statuses."""
    for part in (parts.notch_filter, parts.nominal_trajectory, parts.controller, parts.fault_injector):
        part.reset()
    plant = parts.plant.reset()
    rows: list[dict[str, Any]] = []
    while True:
        filtered = parts.notch_filter.step(float(plant.state[4]))
        nominal = parts.nominal_trajectory.step(plant.state)
        tube = parts.controller.step(controller_input(plant.step, plant.state, filtered, nominal))
        fault = parts.fault_injector.step(plant.step, tube.input)
        rows.append(
            {
                "state": plant.state,
                "filtered_pitch_rate": filtered.filtered_pitch_rate,
                "deviation": nominal.deviation,
                "nominal_input": nominal.input,
                "gain_index": nominal.gain_index,
                "u_unsaturated": tube.u_unsaturated,
                "command": tube.input,
                "actuator": fault.actuator,
                "saturated": tube.saturated,
                "plant_status": int(plant.status),
                "nominal_status": int(nominal.status),
            }
        )
        if plant.status is not FlightStatus.RUNNING:
            return {name: np.array([row[name] for row in rows]) for name in rows[0]}
        plant = parts.plant.step(fault.actuator)

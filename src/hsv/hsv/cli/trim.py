"""The command ``hsv trim``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.flight_point import AT_REST
from hsv.cli.options import (
    AltitudeOption,
    CouplingOption,
    JsonOption,
    UnitsOption,
    VehicleOption,
    VelocityOption,
)
from hsv.cli.output import print_json, print_table, to_json


def trim(
    altitude: AltitudeOption = "85500 ft",
    velocity: VelocityOption = "7900 ft/s",
    climb_rate: Annotated[str, typer.Option(help="Climb rate with unit, e.g. '10 ft/s'.")] = AT_REST[0],
    acceleration: Annotated[str, typer.Option(help="Acceleration with unit, e.g. '4 ft/s^2'.")] = AT_REST[1],
    vehicle: VehicleOption = "",
    coupling: CouplingOption = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compute the equilibrium at an altitude and a velocity (paper eq. 5): level, or climbing and accelerating.

    Example: hsv trim --altitude "85000 ft" --velocity "7702.0808 ft/s" --units paper
    """
    from hsv.cli.flight_point import trim_at
    from hsv.model.dynamics import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS, forces
    from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle

    parameters = load_vehicle(vehicle or DEFAULT_VEHICLE).coupled(coupling)
    result = trim_at(parameters, altitude, velocity, climb_rate, acceleration)
    state = zip(STATE_NAMES, zip(result.state.tolist(), STATE_UNITS, strict=True), strict=True)
    inputs = zip(INPUT_NAMES, zip(result.input.tolist(), INPUT_UNITS, strict=True), strict=True)
    force_units = {"lift": "N", "drag": "N", "thrust": "N", "pitching_moment": "N m", "dynamic_pressure": "Pa"}
    values = forces(result.state, result.input, parameters)
    quantities = {
        **dict(state),
        **dict(inputs),
        **{name: (value, unit) for (name, unit), value in zip(force_units.items(), values, strict=True)},
    }
    if json:
        print_json(to_json(quantities, units) | {"largest_residual_si": result.residual})
    else:
        print_table("Trim", quantities, units, digits=5)

"""The command ``hsv trim``."""

from __future__ import annotations

from hsv.cli.options import AltitudeOption, CouplingOption, JsonOption, UnitsOption, VelocityOption
from hsv.cli.output import Units, print_json, print_table, to_json


def trim(
    altitude: AltitudeOption = "85500 ft",
    velocity: VelocityOption = "7900 ft/s",
    coupling: CouplingOption = "paper_like",
    units: UnitsOption = Units.si,
    json: JsonOption = False,
) -> None:
    """Level equilibrium at an altitude and a velocity (paper eq. 5).

    Example: hsv trim --altitude "85000 ft" --velocity "7702.0808 ft/s" --units paper
    """
    from hsv.cli.flight_point import trim_at
    from hsv.vehicle.dynamics import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS, forces
    from hsv.vehicle.parameters import vehicle_parameters

    vehicle = vehicle_parameters(coupling)
    result = trim_at(vehicle, altitude, velocity)
    state = zip(STATE_NAMES, zip(result.state.tolist(), STATE_UNITS, strict=True), strict=True)
    inputs = zip(INPUT_NAMES, zip(result.input.tolist(), INPUT_UNITS, strict=True), strict=True)
    force_units = {"lift": "N", "drag": "N", "thrust": "N", "pitching_moment": "N m", "dynamic_pressure": "Pa"}
    values = forces(result.state, result.input, vehicle)
    quantities = {
        **dict(state),
        **dict(inputs),
        **{name: (value, unit) for (name, unit), value in zip(force_units.items(), values, strict=True)},
    }
    if json:
        print_json(to_json(quantities, units) | {"largest_residual_si": result.residual})
    else:
        print_table("Trim", quantities, units)

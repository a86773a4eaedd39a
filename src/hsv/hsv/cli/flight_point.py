"""The level equilibrium at a flight condition as it is written on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hsv.vehicle.parameters import VehicleParameters
    from hsv.vehicle.trim import Trim


def trim_at(vehicle: VehicleParameters, altitude: str, velocity: str) -> Trim:
    """Return the level equilibrium at an altitude and a velocity with units.

    Raises:
        QuantityError: One of the two cannot be read.
        TrimError: No equilibrium there; the message repeats the condition as it was written.
    """
    from hsv.units import parse_quantity
    from hsv.vehicle.trim import trim

    condition = parse_quantity(altitude, "m", "altitude"), parse_quantity(velocity, "m/s", "velocity")
    return trim(vehicle, *condition, where=f"altitude = {altitude!r}, velocity = {velocity!r}")

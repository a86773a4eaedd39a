"""The equilibrium at a flight condition as it is written on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hsv.model.trim import Trim
    from hsv.model.vehicle_parameters import VehicleParameters

AT_REST = ("0 m/s", "0 m/s^2")
"""Climb rate and acceleration of level, steady flight."""


def trim_at(
    vehicle: VehicleParameters,
    altitude: str,
    velocity: str,
    climb_rate: str = AT_REST[0],
    acceleration: str = AT_REST[1],
) -> Trim:
    """Return the equilibrium at a condition with units, see :func:`hsv.model.trim.trim`.

    Raises:
        QuantityError: One of them cannot be read; the message names it.
        TrimError: No equilibrium there; the message repeats the condition as it was written.
    """
    from hsv.base.units import parse_quantity
    from hsv.model.trim import trim

    units = {"altitude": "m", "velocity": "m/s", "climb_rate": "m/s", "acceleration": "m/s^2"}
    written = dict(zip(units, (altitude, velocity, climb_rate, acceleration), strict=True))
    condition = {name: parse_quantity(text, units[name], name) for name, text in written.items()}
    shown = [name for name in units if condition[name] or name in ("altitude", "velocity")]
    return trim(vehicle, **condition, where=", ".join(f"{name} = {written[name]!r}" for name in shown))

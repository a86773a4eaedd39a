"""Geometry of the unbent airframe in body axes: x forward and z up from the centre of gravity, in metres.

A station is an x coordinate.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files
from typing import Any

import numpy as np

from hsv.base.units import parse_quantity
from hsv.model.vehicle import load_vehicle

EIGENVALUE = 1.8751040687119611
"""Smallest positive root of 1 + cos(b) cosh(b), for the first mode of a cantilever."""


@dataclass(frozen=True)
class Cantilever:
    """A uniform Euler-Bernoulli cantilever and its first mode, normalised to unit modal mass.

    The deflection at distance s from the clamp is w(s, t) = shape(s) * eta(t); eta (kg^0.5 m) is an elastic coordinate.
    """

    length: float
    """Length in metres."""
    mass_per_length: float
    """Mass per length in kg/m."""

    def shape(self, distance: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Return the mode shape, or its n-th ``derivative`` (kg^-0.5/m^n), at a ``distance`` (m) from the clamp."""
        b = EIGENVALUE
        x = b * np.asarray(distance, float) / self.length
        ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        # The derivatives of cosh - cos and of sinh - sin; the fourth derivative equals the function.
        hyperbolic = (np.cosh(x), np.sinh(x))
        circular = ((-np.cos(x), -np.sin(x)), (np.sin(x), -np.cos(x)), (np.cos(x), np.sin(x)), (-np.sin(x), np.cos(x)))
        turn = derivative % 4
        even = hyperbolic[turn % 2] + circular[turn][0]
        odd = hyperbolic[1 - turn % 2] + circular[turn][1]
        scale = (b / self.length) ** derivative / np.sqrt(self.mass_per_length * self.length)
        return np.asarray(scale * (even - ratio * odd))


Point = tuple[float, float]


@dataclass(frozen=True)
class Airframe:
    """Dimensions and other data of the airframe, in SI units and radians; ``airframe.toml`` explains most of them."""

    fore_body: float
    aft_body: float
    inlet_ramp: float
    engine: float
    nozzle_ramp: float
    upper_surface_angle: float
    inlet_ramp_angle: float
    engine_height: float
    mass_per_length: float
    nose_half_width: float
    half_width: float
    elevator_span: float
    elevator_thickness: float
    full_fuel_equivalence_ratio: float
    exaggeration: float
    largest_exaggeration: float
    thrust_arm: float
    """Distance (m) of the thrust line, the middle of the engine, below the centre of gravity."""
    elevator_arm: float
    """Distance (m) of the elevator's lift behind the centre of gravity."""
    elevator_chord: float

    @property
    def length(self) -> float:
        """Length from nose to tail (m)."""
        return self.fore_body + self.aft_body

    @property
    def inlet(self) -> float:
        """The x coordinate (m) of the inlet, from the centre of gravity."""
        return self.fore_body - self.inlet_ramp

    @property
    def nozzle(self) -> float:
        """The x coordinate (m) at which the engine ends and the nozzle ramp begins, from the centre of gravity."""
        return self.inlet - self.engine

    @property
    def engine_roof(self) -> float:
        """Height z (m) of the body's lower surface above the engine."""
        return 0.5 * self.engine_height - self.thrust_arm

    @property
    def nose(self) -> Point:
        """Position (x, z) of the nose (m)."""
        return self.fore_body, self.engine_roof + self.inlet_ramp * math.tan(self.inlet_ramp_angle)

    @property
    def tail(self) -> Point:
        """Position (x, z) of the tail (m)."""
        return -self.aft_body, float(self.upper(-self.aft_body))

    def upper(self, x: float | np.ndarray) -> Any:
        """Return the height z (m) of the upper surface at the coordinate ``x`` (m), a number or an array."""
        return self.nose[1] + (self.fore_body - x) * math.tan(self.upper_surface_angle)

    def lower(self, x: float | np.ndarray) -> Any:
        """Return the height z (m) of the lower surface at the coordinate ``x`` (m), a number or an array."""
        corners = [self.tail, (self.nozzle, self.engine_roof), (self.inlet, self.engine_roof), self.nose]
        stations, heights = np.array(corners).T
        return np.interp(x, stations, heights)

    def half_width_at(self, x: float) -> float:
        """Return half the width of the body (m) at the coordinate ``x`` (m)."""
        return float(np.interp(x, [self.inlet, self.fore_body], [self.half_width, self.nose_half_width]))

    @cached_property
    def elevator_hinge(self) -> Point:
        """Position (x, z) of the elevator's axis (m): its mid-chord, half-way between the body's surfaces."""
        x = -self.elevator_arm
        return x, 0.5 * float(self.upper(x) + self.lower(x))

    @cached_property
    def cantilevers(self) -> tuple[Cantilever, Cantilever]:
        """The fore body and the aft body, as cantilevers clamped at the centre of gravity."""
        return Cantilever(self.fore_body, self.mass_per_length), Cantilever(self.aft_body, self.mass_per_length)

    def mode(self, x: float) -> int:
        """Return the index of the mode that bends the body at ``x`` (m): 0 for the fore body, 1 for the aft body."""
        return 0 if x >= 0.0 else 1

    def shape(self, x: float, derivative: int = 0) -> float:
        """Return the mode shape at ``x`` (m), up positive, or its n-th ``derivative`` (kg^-0.5/m^n)."""
        return (-1.0 if x < 0.0 and derivative % 2 else 1.0) * float(
            self.cantilevers[self.mode(x)].shape(abs(x), derivative)
        )


@cache
def airframe() -> Airframe:
    """Return the airframe of the drawings, from ``airframe.toml`` and the paper's vehicle."""
    tables = tomllib.loads(files("hsv.pages.airframe").joinpath("airframe.toml").read_text(encoding="utf-8"))
    values = {name: value for table in tables.values() for name, value in table.items()}
    units = {name: "rad" if name.endswith("angle") else "m" for name in values} | {"mass_per_length": "kg/m"}
    lengths = {
        name: value if isinstance(value, float) else parse_quantity(value, units[name], name)
        for name, value in values.items()
    }
    vehicle = load_vehicle().decoupled
    return Airframe(
        **lengths,
        thrust_arm=vehicle.thrust_moment_arm,
        # The lift of the elevator acts where it produces the published moment.
        elevator_arm=-vehicle.moment_elevator * vehicle.mean_aerodynamic_chord / vehicle.lift_elevator,
        elevator_chord=vehicle.mean_aerodynamic_chord,
    )

"""Equations of motion of the vehicle (paper eq. 1 to eq. 4) and their parameters, see ``core/vehicle.h``.

The 9 states x and the 2 inputs u are ordered as in :mod:`hsv.model.signals`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from hsv.base.errors import QuantityError, one_of
from hsv.core import Struct, doubles, ffi, lib, vector
from hsv.model.signals import N_INPUTS, N_STATES

MODELS = ("CM", "DM")
"""Coupled model (paper eq. 1) and decoupled model (paper eq. 4)."""


class VehicleParameters(NamedTuple):
    """All constants of the equations of motion and the limits of inputs and angles, SI (kg, m, s, N, rad).

    Coefficients are annotated with their table in a vehicle file (:mod:`hsv.model.vehicle`) and their unit. Those that
    a vehicle's equations do not contain are zero or as in :data:`AT_REST`. Parker's vehicle is a slice 0.3048 m deep.
    """

    mass: Annotated[float, "rigid_body", "kg"] = 0.0
    moment_of_inertia: Annotated[float, "rigid_body", "kg m^2"] = 0.0
    gravity: Annotated[float, "rigid_body", "m/s^2"] = 0.0
    reference_area: Annotated[float, "geometry", "m^2"] = 0.0
    mean_aerodynamic_chord: Annotated[float, "geometry", "m"] = 0.0
    thrust_moment_arm: Annotated[float, "geometry", "m"] = 0.0
    reference_density: Annotated[float, "atmosphere", "kg/m^3"] = 0.0
    reference_altitude: Annotated[float, "atmosphere", "m"] = 0.0
    density_scale_height: Annotated[float, "atmosphere", "m"] = 0.0
    lift_alpha: Annotated[float, "lift", "1"] = 0.0
    lift_elevator: Annotated[float, "lift", "1"] = 0.0
    lift_zero: Annotated[float, "lift", "1"] = 0.0
    drag_alpha_squared: Annotated[float, "drag", "1"] = 0.0
    drag_alpha: Annotated[float, "drag", "1"] = 0.0
    drag_elevator_squared: Annotated[float, "drag", "1"] = 0.0
    drag_elevator: Annotated[float, "drag", "1"] = 0.0
    drag_zero: Annotated[float, "drag", "1"] = 0.0
    moment_alpha_squared: Annotated[float, "pitching_moment", "1"] = 0.0
    moment_alpha: Annotated[float, "pitching_moment", "1"] = 0.0
    moment_zero: Annotated[float, "pitching_moment", "1"] = 0.0
    moment_elevator: Annotated[float, "pitching_moment", "1"] = 0.0
    thrust_beta_1: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_2: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_3: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_4: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_5: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_6: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_7: Annotated[float, "thrust", "N"] = 0.0
    thrust_beta_8: Annotated[float, "thrust", "N"] = 0.0
    elastic_force_1_alpha_squared: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_1_alpha: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_1_zero: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_2_alpha_squared: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_2_alpha: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_2_elevator: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    elastic_force_2_zero: Annotated[float, "elastic_modes", "N/kg^0.5"] = 0.0
    damping_ratio_1: Annotated[float, "elastic_modes", "1"] = 0.0
    damping_ratio_2: Annotated[float, "elastic_modes", "1"] = 0.0
    natural_frequency_1: Annotated[float, "elastic_modes", "rad/s"] = 0.0
    natural_frequency_2: Annotated[float, "elastic_modes", "rad/s"] = 0.0
    inertial_coupling_1: float = 0.0
    inertial_coupling_2: float = 0.0
    fuel_equivalence_ratio_minimum: float = 0.0
    fuel_equivalence_ratio_maximum: float = 0.0
    elevator_deflection_minimum: float = 0.0
    elevator_deflection_maximum: float = 0.0
    angle_limit: float = 0.0
    gravitational_parameter: Annotated[float, "planet", "m^3/s^2"] = 0.0
    planet_radius: Annotated[float, "planet", "m"] = 0.0
    sound_speed_curvature: Annotated[float, "atmosphere", "m^-1 s^-1"] = 0.0
    sound_speed_slope: Annotated[float, "atmosphere", "s^-1"] = 0.0
    sound_speed_zero: Annotated[float, "atmosphere", "m/s"] = 0.0
    lift_alpha_mach: Annotated[float, "lift", "1"] = 0.0
    lift_elevator_alpha_squared: Annotated[float, "lift", "1"] = 0.0
    lift_elevator_alpha: Annotated[float, "lift", "1"] = 0.0
    drag_scale: Annotated[float, "drag", "1"] = 0.0
    drag_mach_squared: Annotated[float, "drag", "1"] = 0.0
    drag_mach: Annotated[float, "drag", "1"] = 0.0
    thrust_scale: Annotated[float, "thrust", "1"] = 0.0
    thrust_mach: Annotated[float, "thrust", "1"] = 0.0
    thrust_fuel: Annotated[float, "thrust", "1"] = 0.0
    moment_scale: Annotated[float, "pitching_moment", "1"] = 0.0
    moment_mach: Annotated[float, "pitching_moment", "1"] = 0.0
    moment_mach_decay: Annotated[float, "pitching_moment", "1"] = 0.0
    damping_mach: Annotated[float, "pitch_damping", "1"] = 0.0
    damping_mach_zero: Annotated[float, "pitch_damping", "1"] = 0.0
    damping_alpha_squared: Annotated[float, "pitch_damping", "1"] = 0.0
    damping_alpha: Annotated[float, "pitch_damping", "1"] = 0.0
    damping_zero: Annotated[float, "pitch_damping", "1"] = 0.0
    structure: float = 0.0
    """Number of the structure in the core, which is its position in :data:`STRUCTURES`."""

    @property
    def input_minimum(self) -> np.ndarray:
        """Smallest fuel equivalence ratio and elevator deflection (rad): the lower bounds of U (paper eq. 29)."""
        return np.array([self.fuel_equivalence_ratio_minimum, self.elevator_deflection_minimum])

    @property
    def input_maximum(self) -> np.ndarray:
        """Largest fuel equivalence ratio and elevator deflection (rad): the upper bounds of U (paper eq. 29)."""
        return np.array([self.fuel_equivalence_ratio_maximum, self.elevator_deflection_maximum])

    @property
    def form(self) -> Structure:
        """The structure of the vehicle, which is the form of its equations of motion."""
        return [*STRUCTURES.values()][int(self.structure)]

    def decoupled(self) -> VehicleParameters:
        """Return the decoupled model (paper eq. 4): the coupled one without inertial coupling."""
        return self._replace(inertial_coupling_1=0.0, inertial_coupling_2=0.0)

    def perturbed(self, perturbation: Mapping[str, float]) -> VehicleParameters:
        """Return the vehicle with relative changes applied, e.g. ``{"mass": 0.1}`` for +10 %.

        Raises:
            QuantityError: A parameter is unknown, or not in this vehicle's equations while its change is not 0; or a
                change is not finite or not above -100 %.
        """
        changes, names = {}, self.form.names
        for name, change in perturbation.items():
            if name not in names and name in COEFFICIENT_UNITS and change == 0.0:
                continue
            if name not in names:
                expected = one_of(names, name)
                raise QuantityError(f"perturbation.{name} = {change!r}: no such parameter, expected {expected}")
            if not (math.isfinite(change) and change > -1.0):
                raise QuantityError(f"perturbation.{name} = {change!r}: expected a finite relative change above -1")
            changes[name] = getattr(self, name) * (1.0 + change)
        return self._replace(**changes)


_PLACES: dict[str, tuple[str, str]] = {
    name: hint.__metadata__
    for name, hint in get_type_hints(VehicleParameters, include_extras=True).items()
    if hint is not float
}
"""For each coefficient, its table in a vehicle file and its SI unit."""

COEFFICIENT_UNITS = {name: unit for name, (_, unit) in _PLACES.items()}
"""SI units of all coefficients, in the order of :class:`VehicleParameters`."""


@dataclass(frozen=True)
class Structure:
    """The form of the equations of motion: its coefficients, and whether the body bends.

    The state always has nine entries; in a rigid vehicle the four elastic ones stay at rest.
    """

    names: tuple[str, ...]
    elastic: bool
    optional: tuple[str, ...] = ()
    """Coefficients of ``names`` that a vehicle may leave out; they are then zero."""

    @cached_property
    def tables(self) -> dict[str, dict[str, str]]:
        """For each table of a vehicle file, the names and SI units of its coefficients."""
        found: dict[str, dict[str, str]] = {}
        for name in self.names:
            table, unit = _PLACES[name]
            found.setdefault(table, {})[name] = unit
        return found


_ELEVATOR_LIFT = ("lift_elevator_alpha_squared", "lift_elevator_alpha", "lift_elevator")

STRUCTURES = {
    "parker": Structure(
        VehicleParameters._fields[: VehicleParameters._fields.index("inertial_coupling_1")], elastic=True
    ),
    "winged_cone": Structure(
        (
            *("mass", "moment_of_inertia", "reference_area", "mean_aerodynamic_chord"),
            *("reference_density", "reference_altitude", "density_scale_height", "lift_alpha"),
            *("drag_alpha_squared", "drag_alpha"),
            *("moment_alpha_squared", "moment_alpha", "moment_zero", "moment_elevator"),
            *("gravitational_parameter", "planet_radius"),
            *("sound_speed_curvature", "sound_speed_slope", "sound_speed_zero"),
            *("lift_alpha_mach", "drag_scale", "drag_mach_squared", "drag_mach"),
            *("thrust_scale", "thrust_mach", "thrust_fuel"),
            *("moment_scale", "moment_mach", "moment_mach_decay"),
            *("damping_mach", "damping_mach_zero", "damping_alpha_squared", "damping_alpha", "damping_zero"),
            *_ELEVATOR_LIFT,
        ),
        elastic=False,
        optional=_ELEVATOR_LIFT,
    ),
}
"""All structures by name, in the order of their codes in ``core/vehicle.h``; the first is the default."""

AT_REST = {"damping_ratio_1": 1.0, "damping_ratio_2": 1.0, "natural_frequency_1": 20.0, "natural_frequency_2": 20.0}
"""Damping ratios and natural frequencies (rad/s) that keep the elastic states of a rigid vehicle at rest."""

POSITIVE = frozenset(
    {
        *("mass", "moment_of_inertia", "gravity", "reference_area", "mean_aerodynamic_chord"),
        *("reference_density", "density_scale_height", "natural_frequency_1", "natural_frequency_2"),
        *("gravitational_parameter", "planet_radius", "sound_speed_zero", "moment_mach_decay"),
    }
)
"""Coefficients that must be above zero."""


@lru_cache(maxsize=64)
def vehicle_struct(vehicle: VehicleParameters) -> Struct:
    """Return the parameters as the struct ``hsv_vehicle`` of the core."""
    return Struct("hsv_vehicle", **vehicle._asdict())


def forces(
    x: np.ndarray, u: np.ndarray, p: VehicleParameters, conditions: np.ndarray | None = None
) -> tuple[float, float, float, float, float]:
    """Return lift (N), drag (N), thrust (N), pitching moment (N m) and dynamic pressure (Pa) (paper eq. 2, eq. 3).

    Lift is perpendicular to the inertial velocity, drag opposite to it.

    Args:
        x: State, shape (9,).
        u: Input, shape (2,).
        p: Parameters.
        conditions: Air and engine, shape (7,): wind forward and up (m/s), density relative to the model's, factors of
            thrust, lift and drag, and increment of the pitching moment coefficient. None: still air, working engine.
    """
    found = ffi.new("double[6]")
    lib.hsv_forces(
        doubles(vector(x), N_STATES),
        doubles(vector(u), N_INPUTS),
        vehicle_struct(p).pointer,
        _conditions(conditions),
        found,
    )
    lift, drag, thrust, moment, pressure, _ = found
    return lift, drag, thrust, moment, pressure


def derivative(x: Any, u: Any, p: VehicleParameters, conditions: np.ndarray | None = None) -> np.ndarray:
    """Return dx/dt, shape (9,), of the coupled model (paper eq. 1); with zero coupling, the decoupled one (eq. 4).

    A complex state or input gives a complex derivative, for the complex step; ``conditions`` are then ignored.
    """
    struct = vehicle_struct(p).pointer
    if np.iscomplexobj(x) or np.iscomplexobj(u):
        z, v, rates = np.array(x, complex), np.array(u, complex), np.empty(N_STATES, complex)
        lib.hsv_complex_derivative(
            doubles(z.view(float), 2 * N_STATES),
            doubles(v.view(float), 2 * N_INPUTS),
            struct,
            doubles(rates.view(float)),
        )
        return rates
    out = np.empty(N_STATES)
    lib.hsv_derivative(
        doubles(vector(x), N_STATES), doubles(vector(u), N_INPUTS), struct, _conditions(conditions), doubles(out)
    )
    return out


def jacobian(x: np.ndarray, u: np.ndarray, p: VehicleParameters) -> tuple[np.ndarray, np.ndarray]:
    """Return A = df/dx (9, 9) and B = df/du (9, 2), by the complex step (paper eq. 6, eq. 7, eq. 8, eq. 9).

    They are exact to rounding: the square of the step vanishes, and no numbers of similar size are subtracted.
    """
    A, B = np.empty((N_STATES, N_STATES)), np.empty((N_STATES, N_INPUTS))
    lib.hsv_jacobian(
        doubles(vector(x), N_STATES), doubles(vector(u), N_INPUTS), vehicle_struct(p).pointer, doubles(A), doubles(B)
    )
    return A, B


def advance(
    x: np.ndarray,
    u: np.ndarray,
    p: VehicleParameters,
    period: float,
    substeps: int,
    conditions: np.ndarray | None = None,
) -> np.ndarray:
    """Return the state one ``period`` (s) after the state ``x``, by ``substeps`` classical Runge-Kutta steps.

    The input ``u`` and the ``conditions``, see :func:`forces`, are held.
    """
    new = np.array(x, float)
    lib.hsv_advance(
        doubles(new, N_STATES),
        doubles(vector(u), N_INPUTS),
        vehicle_struct(p).pointer,
        _conditions(conditions),
        period,
        substeps,
    )
    return new


def _conditions(conditions: np.ndarray | None) -> Any:
    return ffi.NULL if conditions is None else doubles(vector(conditions), lib.CONDITIONS)


def in_model_range(x: np.ndarray, angle_limit: float) -> bool:
    """Return whether ``x`` is finite, V > 0, and angle of attack and pitch angle are within +-``angle_limit`` (rad)."""
    return bool(lib.hsv_in_model_range(doubles(vector(x), 9), angle_limit))

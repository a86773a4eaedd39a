"""Equilibrium of flight at a given altitude and velocity (paper eq. 5): level, or with climb and acceleration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hsv.base.errors import ParameterError, QuantityError, TrimError
from hsv.base.parameters import Parameter, validate
from hsv.base.units import parse_quantity
from hsv.core import doubles, lib
from hsv.core.arithmetic import arcsine
from hsv.model.dynamics import MODELS, VehicleParameters, derivative, vehicle_struct
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_INPUTS, N_RIGID, N_STATES, STATE_NAMES, STATE_UNITS
from hsv.model.vehicle import COUPLING_PARAMETER, Vehicle

CONVERGED = 1e-9
"""Largest imbalance (SI per second) accepted as an equilibrium; Newton's method converges far below."""

INITIAL_GUESS = np.array([0.03, 0.3, 0.2])
"""Angle of attack (rad), fuel equivalence ratio and elevator deflection (rad); Newton's method converges from it."""


@dataclass(frozen=True)
class Trim:
    """An equilibrium (SI): ``state``, shape (9,), ``input``, shape (2,), and the largest imbalance left, ``residual``.

    The imbalance of a state is |dx/dt| (SI per second) after the commanded climb rate and acceleration are subtracted.
    """

    state: np.ndarray
    input: np.ndarray
    residual: float

    @property
    def quantities(self) -> dict[str, tuple[float, str]]:
        """Value and SI unit of each state and input by name; the elastic states of a rigid vehicle are left out."""
        n = N_STATES if self.state[N_RIGID:].any() else N_RIGID
        values = (*self.state[:n].tolist(), *self.input.tolist())
        units = (*STATE_UNITS[:n], *INPUT_UNITS)
        return dict(zip((*STATE_NAMES[:n], *INPUT_NAMES), zip(values, units, strict=True), strict=True))


def trim(
    vehicle: VehicleParameters,
    altitude: float,
    velocity: float,
    climb_rate: float = 0.0,
    acceleration: float = 0.0,
    where: str = "",
) -> Trim:
    """Return the equilibrium at ``altitude`` (m) and ``velocity`` (m/s) (paper eq. 5), by Newton's method.

    V sin(theta - alpha) = ``climb_rate`` (m/s) and dV/dt = ``acceleration`` (m/s^2), both zero by default. The angle of
    attack is constant, the pitch rate is zero, and the elastic modes are at rest.

    ``where`` describes the condition in error messages; by default they state it in SI units.

    Raises:
        TrimError: The condition is impossible, or it has no equilibrium, or only one outside the input limits.
    """
    if not where:
        where = f"altitude = {altitude:.6g} m, velocity = {velocity:.6g} m/s"
        if climb_rate or acceleration:
            where += f", climb rate = {climb_rate:.6g} m/s, acceleration = {acceleration:.6g} m/s^2"
    if not (np.isfinite(altitude) and np.isfinite(velocity) and velocity > 0.0):
        raise TrimError(f"{where}: expected a finite altitude and a positive velocity")
    if not (abs(climb_rate) < velocity and np.isfinite(acceleration)):
        raise TrimError(f"{where}: expected a climb rate below the velocity and a finite acceleration")
    x, u = np.zeros(N_STATES), np.zeros(N_INPUTS)
    x[0], x[1] = altitude, velocity
    # Newton's method completes state and input; size is the greatest remaining imbalance, see hsv_balance in trim.h.
    rigid, path_angle = vehicle_struct(vehicle.decoupled()).pointer, arcsine(climb_rate / velocity)
    size = lib.hsv_balance(rigid, path_angle, acceleration, 0.0, *map(doubles, (INITIAL_GUESS.copy(), x, u)))
    check_equilibrium(where, size, u, vehicle)
    rates = derivative(x, u, vehicle)
    rates[:2] -= climb_rate, acceleration
    return Trim(x, u, float(np.max(np.abs(rates))))


def trim_at(
    vehicle: VehicleParameters,
    altitude: float | str,
    velocity: float | str,
    climb_rate: float | str = 0.0,
    acceleration: float | str = 0.0,
) -> Trim:
    """Return the equilibrium at a condition given by numbers (SI) or texts with units, see :func:`trim`.

    Raises:
        QuantityError: A text is not a finite quantity with a unit of the right dimension.
        TrimError: See :func:`trim`; the message repeats the condition as it was given.
    """
    units = {"altitude": "m", "velocity": "m/s", "climb_rate": "m/s", "acceleration": "m/s^2"}
    given = dict(zip(units, (altitude, velocity, climb_rate, acceleration), strict=True))
    condition = {
        name: parse_quantity(value, units[name], name) if isinstance(value, str) else float(value)
        for name, value in given.items()
    }
    shown = [name for name in units if condition[name] or name in ("altitude", "velocity")]
    return trim(vehicle, **condition, where=", ".join(f"{name} = {given[name]!r}" for name in shown))


def check_equilibrium(where: str, size: float, u: np.ndarray, vehicle: VehicleParameters) -> None:
    """Check that the imbalance ``size`` is below :data:`CONVERGED` and the input ``u``, shape (2,), within its limits.

    Raises:
        TrimError: The imbalance is too large or an input is outside; the message names ``where`` and the reason.
    """
    if not size < CONVERGED:
        raise TrimError(f"{where}: no equilibrium there, expected a condition inside the trimmable envelope")
    limits = vehicle.input_minimum, vehicle.input_maximum
    for name, unit, value, low, high in zip(INPUT_NAMES, ("", " rad"), u, *limits, strict=True):
        if not low <= value <= high:
            raise TrimError(f"{where}: trim needs {name} = {value:.6g}{unit}, expected {low:.6g} to {high:.6g}{unit}")


INITIAL_PARAMETERS = (
    Parameter("vehicle.model", "CM", "coupled model (paper eq. 1) or decoupled model (eq. 4)", choices=MODELS),
    COUPLING_PARAMETER,
    Parameter("initial.altitude", 26060.4, "altitude of the initial trim, in the vehicle's range", "m"),
    Parameter("initial.velocity", 2407.92, "velocity of the initial trim, in the vehicle's range", "m/s"),
)


def initial_trim(values: Mapping[str, object]) -> tuple[VehicleParameters, Trim]:
    """Return the nominal vehicle and the initial trim of a flight, given values of the plant's parameters."""
    v = validate(INITIAL_PARAMETERS, values)
    vehicle = Vehicle.from_parameters(values)
    vehicle.check_envelope(INITIAL_PARAMETERS, v)
    try:
        nominal = vehicle.coupled(v["vehicle.coupling"])
    except QuantityError as error:
        raise ParameterError(f"parameter vehicle.{error}") from error
    if v["vehicle.model"] == "DM":
        nominal = nominal.decoupled()
    return nominal, trim(nominal, v["initial.altitude"], v["initial.velocity"])

"""The vehicle's parameters: read from the published table with its units, held in SI, perturbed by name."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

from hsv.errors import QuantityError
from hsv.units import in_base_units, parse_quantity

COUPLING_SETS = ("paper_like", "derived")
"""Named sets of inertial coupling that a vehicle may fly with."""

MODELS = ("CM", "DM")
"""Coupled model (paper eq. 1) and decoupled model (paper eq. 4)."""


class VehicleParameters(NamedTuple):
    """All constants of the equations of motion, SI (kg, m, s, N, rad; a slice of the vehicle 0.3048 m deep).

    Field names, units and symbols are those of ``vehicle.toml``. A named tuple, so that compiled functions take it.
    """

    mass: float
    moment_of_inertia: float
    gravity: float
    reference_area: float
    mean_aerodynamic_chord: float
    thrust_moment_arm: float
    reference_density: float
    reference_altitude: float
    density_scale_height: float
    lift_alpha: float
    lift_elevator: float
    lift_zero: float
    drag_alpha_squared: float
    drag_alpha: float
    drag_elevator_squared: float
    drag_elevator: float
    drag_zero: float
    moment_alpha_squared: float
    moment_alpha: float
    moment_zero: float
    moment_elevator: float
    thrust_beta_1: float
    thrust_beta_2: float
    thrust_beta_3: float
    thrust_beta_4: float
    thrust_beta_5: float
    thrust_beta_6: float
    thrust_beta_7: float
    thrust_beta_8: float
    elastic_force_1_alpha_squared: float
    elastic_force_1_alpha: float
    elastic_force_1_zero: float
    elastic_force_2_alpha_squared: float
    elastic_force_2_alpha: float
    elastic_force_2_elevator: float
    elastic_force_2_zero: float
    damping_ratio_1: float
    damping_ratio_2: float
    natural_frequency_1: float
    natural_frequency_2: float
    inertial_coupling_1: float
    inertial_coupling_2: float

    def decoupled(self) -> VehicleParameters:
        """Return the decoupled model (paper eq. 4): the coupled one without inertial coupling."""
        return self._replace(inertial_coupling_1=0.0, inertial_coupling_2=0.0)

    def with_coupling_scale(self, kappa: float) -> VehicleParameters:
        """Return the vehicle with ``kappa`` times the derived inertial coupling (kappa = 0.25: paper-like)."""
        derived = vehicle_parameters("derived")
        return self._replace(
            inertial_coupling_1=kappa * derived.inertial_coupling_1,
            inertial_coupling_2=kappa * derived.inertial_coupling_2,
        )

    def perturbed(self, perturbation: Mapping[str, float]) -> VehicleParameters:
        """Return the vehicle with relative changes applied, e.g. ``{"mass": 0.1}`` for +10 %.

        Raises:
            QuantityError: An unknown parameter, or a change that is not finite or not above -100 %.
        """
        changes = {}
        for name, change in perturbation.items():
            if name not in self._fields:
                expected = ", ".join(uncertainty_bounds())
                raise QuantityError(f"perturbation.{name} = {change!r}: no such parameter, expected one of {expected}")
            if not (math.isfinite(change) and change > -1.0):
                raise QuantityError(f"perturbation.{name} = {change!r}: expected a finite relative change above -1")
            changes[name] = getattr(self, name) * (1.0 + change)
        return self._replace(**changes)


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads(files("hsv.vehicle").joinpath("vehicle.toml").read_text(encoding="utf-8"))


def _rows(coupling: str) -> dict[str, dict[str, str]]:
    table = dict(_table())
    couplings = table.pop("inertial_coupling")
    rows: dict[str, dict[str, str]] = {}
    for section in (*table.values(), couplings[coupling]):
        rows.update(section)
    return rows


@cache
def vehicle_parameters(coupling: str = "paper_like") -> VehicleParameters:
    """Return the published vehicle with a named set of inertial coupling.

    Args:
        coupling: ``"paper_like"``, ``"derived"`` or ``"decoupled"``.

    Raises:
        QuantityError: No such set.
    """
    if coupling not in (*COUPLING_SETS, "decoupled"):
        raise QuantityError(f"coupling = {coupling!r}: expected one of {', '.join(COUPLING_SETS)}")
    return VehicleParameters(**{name: in_base_units(row["value"]) for name, row in _rows(coupling).items()})


def paper_like_scale() -> float:
    """Return kappa of the paper-like set: its inertial coupling as a share of the derived."""
    return vehicle_parameters("paper_like").inertial_coupling_1 / vehicle_parameters("derived").inertial_coupling_1


def uncertain_parameters() -> list[str]:
    """Return the names of the paper's ten uncertain parameters (section 5.1)."""
    return [name for name, row in _rows("derived").items() if "uncertainty" in row]


@cache
def uncertainty_bounds() -> Mapping[str, float]:
    """Return the relative bound of each of the paper's ten uncertain parameters (section 5.1), by name."""
    rows = _rows("derived")
    return {name: parse_quantity(rows[name]["uncertainty"], "1", name) for name in uncertain_parameters()}

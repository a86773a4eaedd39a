"""The flat ROS 2 parameters of a controller design: their declarations, their arrays, their digest."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.parameters import Parameter
from hsv.control.notch_filter import DESIGN_NOTCH_PARAMETERS
from hsv.control.tube_factor import TAU, TAU_MINIMUM
from hsv.model.lpv.polytope import INTERPOLATIONS

DESIGN_PARAMETERS = (
    Parameter("design.name", "", "name of the design"),
    Parameter("design.hash", "", "digest of all other parameters of the design, as it was written"),
    *DESIGN_NOTCH_PARAMETERS,
    Parameter("model.a", [], "state matrices A_i of all vertices, row by row, altitude-major (SI, discrete time)"),
    Parameter("model.b", [], "input matrices B_i of all vertices, row by row, altitude-major (SI, discrete time)"),
    Parameter("scheduling.interpolation", "linear", "weights between breakpoints", choices=INTERPOLATIONS),
    Parameter("scheduling.altitude.breakpoints", [], "altitudes at which weights are given", "m"),
    Parameter("scheduling.altitude.weights", [], "weights of the vertices in altitude, a row per breakpoint"),
    Parameter("scheduling.velocity.breakpoints", [], "velocities at which weights are given", "m/s"),
    Parameter("scheduling.velocity.weights", [], "weights of the vertices in velocity, a row per breakpoint"),
    Parameter("feedback.gain", [], "auxiliary feedback gain F, 2 x 9, row by row (SI)"),
    TAU,
    TAU_MINIMUM,
    Parameter("nominal.filtered", False, "feedback on q_f minus the filtered nominal pitch rate (paper eq. 48)"),
    Parameter("nominal.gains", [], "nominal gains K, each 2 x 9, row by row, outermost ellipsoid first (SI)"),
    Parameter("nominal.ellipsoids", [], "P of x' P x <= 1 on the rigid states, each 5 x 5, outermost first (SI)"),
    Parameter("nominal.interpolated", False, "whether the gain is interpolated between two ellipsoids, or switched"),
    Parameter("design.coupling", "", "set of inertial coupling for which the tube is certified"),
    Parameter("design.actuators", "", "actuators for which the tube is certified, by name; empty: ideal ones"),
    Parameter("design.vehicle", "", "digest of the vehicle of the design; empty: the default one"),
    Parameter("tube.centre", [], "centre c of the invariant set: five rigid states, then the notch filter's (SI)"),
    Parameter("tube.shape", [], "P of (e - c)' P (e - c) <= 1, row by row (SI); empty: the design has no set"),
    Parameter("tube.half_width", [], "half-widths z of the invariant set about its centre (SI)"),
    Parameter("nominal.state_scale", [], "rigid deviations (5) that weigh equally in the nominal cost (SI)"),
    Parameter("nominal.input_scale", [], "fuel equivalence ratio (-) and elevator deflection (rad) that weigh as much"),
    Parameter("nominal.input_bound", [], "largest |u_n| of the nominal gains: fuel (-), elevator (rad)"),
    Parameter("nominal.input_minimum", [], "least u_r + u_n, U minus F Z: fuel (-), elevator (rad)"),
    Parameter("nominal.input_maximum", [], "largest u_r + u_n, U minus F Z: fuel (-), elevator (rad)"),
    Parameter("nominal.region_minimum", [], "least fuel (-), elevator (rad), pitch rad/s^2, that W covers"),
    Parameter("nominal.region_maximum", [], "largest fuel (-), elevator (rad), pitch rad/s^2, that W covers"),
    Parameter("input.minimum", [], "least fuel equivalence ratio (-) and elevator deflection (rad)"),
    Parameter("input.maximum", [], "largest fuel equivalence ratio (-) and elevator deflection (rad)"),
)
"""Parameters of a design, as declared by the nodes."""

NO_DESIGN = "none"
"""Name of the design in the parameters of a node that flies without one: nodes have a default."""


def brings_design(values: Mapping[str, Any]) -> bool:
    """Tell whether there is a design in the flat parameters of a flight."""
    if values.get("design.name") == NO_DESIGN:
        return False
    flown_with_any = {parameter.name for parameter in (*DESIGN_NOTCH_PARAMETERS, TAU)}
    return any(parameter.name in values for parameter in DESIGN_PARAMETERS if parameter.name not in flown_with_any)


def digest(values: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a design's flat parameters.

    Left out are ``design.hash``, ``feedback.tau``, which may be anything certified, and what is empty or as if absent.
    """
    known = {p.name for p in DESIGN_PARAMETERS} - {"design.hash", TAU.name}
    absent = {TAU_MINIMUM.name: TAU_MINIMUM.default, "nominal.filtered": False, "nominal.interpolated": False}
    said = {name: values[name] for name in sorted(known & values.keys()) if values[name] != absent.get(name, "")}
    text = json.dumps({name: value for name, value in said.items() if value != []})
    return hashlib.sha256(text.encode()).hexdigest()


def shaped(values: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array of a parameter; a size of -1 follows from its length.

    Raises:
        DesignError: It has another number of values.
    """
    array = np.array(values[name], float)
    unit = int(np.prod([n for n in shape if n > 0]))
    if array.size == 0 or (array.size % unit if -1 in shape else array.size != unit):
        expected = f"a multiple of {unit}" if -1 in shape else str(unit)
        raise DesignError(f"parameter {name}: {array.size} values, expected {expected}")
    return np.ascontiguousarray(array.reshape(shape))


def positive(values: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the same, of values above zero."""
    array = shaped(values, name, shape)
    if not np.all(array > 0.0):
        raise DesignError(f"parameter {name} = {array.tolist()}: expected values above zero")
    return array


def samples(values: Mapping[str, Any], axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Return breakpoints (n) and weights (n, v) along an axis of scheduling."""
    breakpoints = np.array(values[f"{axis}.breakpoints"], float)
    if len(breakpoints) < 2:
        raise DesignError(f"parameter {axis}.breakpoints: {len(breakpoints)} values, expected at least 2")
    return breakpoints, shaped(values, f"{axis}.weights", (len(breakpoints), -1))

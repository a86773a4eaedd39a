"""A controller design: the numbers that fly, one object from its file to the controller."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from hsv.base.errors import DesignError, ParameterError
from hsv.base.parameters import check_all
from hsv.control.design_parameters import DESIGN_PARAMETERS, brings_design, digest, positive, samples, shaped
from hsv.control.notch_filter import NotchSection, discretise, flown_sections
from hsv.control.plan_bounds import PlanBounds
from hsv.control.tube_factor import TAU, TAU_MINIMUM, certified, compact, rigid_factors
from hsv.control.tube_set import TubeSet
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.dynamics import N_INPUTS, N_RIGID, N_STATES
from hsv.model.lpv.polytope import Polytope, axis_weights


@dataclass(frozen=True)
class ControlDesign:
    """The numbers a Tube-MPC controller flies with, SI, state order as in :mod:`hsv.model.dynamics`.

    ``feedback_gain`` F (2, 9); ``nominal_gains`` K (g, 2, 9) and ``nominal_ellipsoids`` P (g, 5, 5), x' P x <= 1 on the
    rigid states, outermost first; the nominal cost's ``nominal_state_scale`` (5) and ``nominal_input_scale`` (2), and
    ``nominal_input_bound`` (2), the largest |u_n| of the gains; ``input_minimum`` and ``input_maximum`` (2); ``notch``:
    the filter it was designed with.
    """

    name: str
    period: float
    polytope: Polytope
    interpolation: str
    altitude_samples: tuple[np.ndarray, np.ndarray]
    velocity_samples: tuple[np.ndarray, np.ndarray]
    feedback_gain: np.ndarray
    nominal_gains: np.ndarray
    nominal_ellipsoids: np.ndarray
    nominal_state_scale: np.ndarray
    nominal_input_scale: np.ndarray
    nominal_input_bound: np.ndarray
    input_minimum: np.ndarray
    input_maximum: np.ndarray
    notch: tuple[NotchSection, ...]
    coupling: str = ""
    """Set of inertial coupling that the tube is certified for, empty: the design carries no tube."""
    actuators: tuple[str, ...] = ()
    """Names of the actuators that the tube is certified for, ideal where a channel has none."""
    vehicle: str = ""
    """Digest of the vehicle that the design is for, empty: the default one."""
    tube: TubeSet | None = None
    """The invariant set of the tube error, ``None``: the design carries none."""
    plan_bounds: PlanBounds | None = None
    """Bounds of the total nominal input; ``None``: the design has no tightened inputs."""
    tau: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Factor (5) of each rigid state's feedback that the design flies with."""
    tau_minimum: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Least factor (5) for which the feedback is certified, up to 1."""
    interpolated: bool = False
    """Whether the nominal gain between two ellipsoids is one between theirs: then u_n is continuous."""
    filtered: bool = False
    """Whether the feedback acts on the filtered pitch rate less that of the plan through the same filter (eq. 48)."""
    modified: bool = False
    """Whether the parameters differ from those that were written (their digest does not match)."""

    def adjusted_gain(self, tau: np.ndarray) -> np.ndarray:
        """Return F (2, 9) with each rigid state's column times its factor ``tau`` (5) (paper eq. 48, eq. 54)."""
        gain = self.feedback_gain.copy()
        gain[:, :N_RIGID] *= tau
        return gain

    def with_tau(self, values: Sequence[float]) -> Self:
        """Return the design that flies with the factors ``values``, one or five.

        Raises:
            ParameterError: They are not certified.
            DesignError: The closed loop is not stable with them.
        """
        tau = certified(TAU.check(values), self.tau_minimum)
        _check_stable(TAU.name, self.polytope, self.adjusted_gain(tau))
        return replace(self, tau=tau)

    @property
    def digest(self) -> str:
        """The digest of the parameters as they are."""
        return str(self.to_parameters()["design.hash"])

    def to_parameters(self) -> dict[str, Any]:
        """Return the flat ROS 2 parameters, digest included."""
        values: dict[str, Any] = {
            "design.name": self.name,
            "period": self.period,
            **{f"notch.{name}": np.array([getattr(s, name) for s in self.notch]) for name in vars(self.notch[0])},
            "model.a": self.polytope.A,
            "model.b": self.polytope.B,
            "scheduling.interpolation": self.interpolation,
            "scheduling.altitude.breakpoints": self.altitude_samples[0],
            "scheduling.altitude.weights": self.altitude_samples[1],
            "scheduling.velocity.breakpoints": self.velocity_samples[0],
            "scheduling.velocity.weights": self.velocity_samples[1],
            **{name: getattr(self, field) for field, (name, _) in _ARRAYS.items()},
        }
        adjustable = {TAU.name: self.tau, TAU_MINIMUM.name: self.tau_minimum}
        values |= {name: compact(tau) for name, tau in adjustable.items() if np.any(tau != 1.0)}
        if self.filtered:
            values["nominal.filtered"] = True
        if self.interpolated:
            values["nominal.interpolated"] = True
        if self.actuators:
            values["design.actuators"] = " ".join(self.actuators)
        if self.vehicle:
            values["design.vehicle"] = self.vehicle
        if self.tube:
            values |= {"design.coupling": self.coupling} | {f"tube.{name}": v for name, v in vars(self.tube).items()}
        if self.plan_bounds:
            values |= {f"nominal.{name}": value for name, value in vars(self.plan_bounds).items()}
        flat = {
            name: np.asarray(value, float).ravel().tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
        }
        return {"design.hash": digest(flat), **flat}

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> Self:
        """Return the design in ``values``, checked: types, sizes, finite numbers, and a stable closed loop.

        Raises:
            DesignError: Names the parameter that is wrong and what was expected.
        """
        try:
            v = check_all(DESIGN_PARAMETERS, values)
            notch = flown_sections(v)
            discretise(notch, v["period"])  # refuses centres that the period has no room for
            tau_minimum = rigid_factors(v[TAU_MINIMUM.name], TAU_MINIMUM.name)
            tau = certified(v[TAU.name], tau_minimum)
        except ParameterError as error:
            raise DesignError(str(error)) from error
        altitude, velocity = samples(v, "scheduling.altitude"), samples(v, "scheduling.velocity")
        vertices = altitude[1].shape[1] * velocity[1].shape[1]
        try:
            axes = [axis_weights(*axis, v["scheduling.interpolation"]) for axis in (altitude, velocity)]
        except DesignError as error:
            raise DesignError(f"parameter scheduling.*: {error}") from error
        A = shaped(v, "model.a", (vertices, N_STATES, N_STATES))
        B = shaped(v, "model.b", (vertices, N_STATES, N_INPUTS))
        design = cls(
            name=v["design.name"],
            period=v["period"],
            polytope=Polytope(A, B, axes[0], axes[1]),
            interpolation=v["scheduling.interpolation"],
            altitude_samples=altitude,
            velocity_samples=velocity,
            notch=notch,
            coupling=v["design.coupling"],
            actuators=_actuators(v["design.actuators"]),
            vehicle=v["design.vehicle"],
            tube=_tube(v, N_RIGID + 2 * len(notch)),
            plan_bounds=_plan_bounds(v),
            tau=tau,
            tau_minimum=tau_minimum,
            interpolated=v["nominal.interpolated"],
            filtered=v["nominal.filtered"],
            modified=v["design.hash"] != digest(v),
            **{
                field: (positive if field in _POSITIVE else shaped)(v, name, shape)
                for field, (name, shape) in _ARRAYS.items()
            },
        )
        if len(design.nominal_gains) != len(design.nominal_ellipsoids):
            raise DesignError(
                f"parameter nominal.ellipsoids: {len(design.nominal_ellipsoids)} matrices, "
                f"expected one per gain, {len(design.nominal_gains)}"
            )
        if not np.all(design.input_minimum < design.input_maximum):
            raise DesignError("parameter input.minimum: expected values below input.maximum")
        _check_stable("feedback.gain", design.polytope, design.feedback_gain)
        _check_stable(TAU.name, design.polytope, design.adjusted_gain(tau))
        for gain in design.nominal_gains:
            _check_stable("nominal.gains", design.polytope, gain)
        return design


_ARRAYS = {
    "feedback_gain": ("feedback.gain", (N_INPUTS, N_STATES)),
    "nominal_gains": ("nominal.gains", (-1, N_INPUTS, N_STATES)),
    "nominal_ellipsoids": ("nominal.ellipsoids", (-1, N_RIGID, N_RIGID)),
    "nominal_state_scale": ("nominal.state_scale", (N_RIGID,)),
    "nominal_input_scale": ("nominal.input_scale", (N_INPUTS,)),
    "nominal_input_bound": ("nominal.input_bound", (N_INPUTS,)),
    "input_minimum": ("input.minimum", (N_INPUTS,)),
    "input_maximum": ("input.maximum", (N_INPUTS,)),
}
"""Parameter and shape of the fields that are one array each."""

_POSITIVE = ("nominal_state_scale", "nominal_input_scale", "nominal_input_bound")


def design_of(values: Mapping[str, Any]) -> ControlDesign | None:
    """Return the design in the flat parameters of a flight, ``None`` where there is none.

    Raises:
        DesignError: See :meth:`ControlDesign.from_parameters`.
    """
    return ControlDesign.from_parameters(values) if brings_design(values) else None


def _tube(values: Mapping[str, Any], n: int) -> TubeSet | None:
    if not any(values[f"tube.{name}"] for name in ("centre", "shape", "half_width")):
        return None
    shape = shaped(values, "tube.shape", (n, n))
    if not (np.allclose(shape, shape.T, rtol=1e-9, atol=0.0) and np.linalg.eigvalsh(shape)[0] > 0.0):
        raise DesignError("parameter tube.shape: expected a symmetric positive definite matrix")
    return TubeSet(shaped(values, "tube.centre", (n,)), shape, positive(values, "tube.half_width", (n,)))


def _actuators(text: str) -> tuple[str, ...]:
    for name in (names := tuple(text.split())):
        if name not in ACTUATOR_SETS:
            raise DesignError(f"parameter design.actuators = {text!r}: expected names from {', '.join(ACTUATOR_SETS)}")
    return names


def _plan_bounds(values: Mapping[str, Any]) -> PlanBounds | None:
    sizes = {"input_minimum": 2, "input_maximum": 2, "region_minimum": 3, "region_maximum": 3}
    if not any(values[f"nominal.{name}"] for name in sizes):
        return None
    bounds = PlanBounds(**{name: shaped(values, f"nominal.{name}", (size,)) for name, size in sizes.items()})
    for name in ("input", "region"):
        if not np.all(getattr(bounds, f"{name}_minimum") < getattr(bounds, f"{name}_maximum")):
            raise DesignError(f"parameter nominal.{name}_minimum: expected values below nominal.{name}_maximum")
    return bounds


def _check_stable(name: str, polytope: Polytope, gain: np.ndarray) -> None:
    # The flexible states follow the rigid ones and have poles of their own: all nine must be inside the unit circle.
    for vertex, (a, b) in enumerate(zip(polytope.A, polytope.B, strict=True)):
        radius = float(np.max(np.abs(np.linalg.eigvals(a + b @ gain))))
        if not radius < 1.0:
            raise DesignError(
                f"parameter {name}: spectral radius {radius:.6f} of the closed loop at vertex {vertex}, "
                "expected below 1"
            )

"""A controller design: its parameters and its numbers in flight; its files are in :mod:`hsv.control.design_file`."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self

import numpy as np

from hsv.base.errors import DesignError, ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.control.notch_filter import DESIGN_NOTCH_PARAMETERS, NotchSection, discretise, flown_sections
from hsv.model.actuators import ACTUATOR_SETS, ActuatorSet
from hsv.model.lpv.polytope import INTERPOLATIONS, Polytope, axis_weights
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES, STATE_NAMES, first_step

FACTORS = "one value, or one for each rigid state"

TAU = Parameter("feedback.tau", [1.0], f"adjustable factor of the feedback gain: {FACTORS}", "", 0.0, 1.0)
TAU_MINIMUM = Parameter("feedback.tau_minimum", [1.0], f"least certified factor, up to 1: {FACTORS}", "", 0.0, 1.0)

_SAME_SHARE = 1e-9
"""Factors are on the certified line if (1 - tau) / (1 - minimum) differs between them by no more than this."""

TAU_CHANGE_PARAMETERS = (
    Parameter("tau_change.starts", [], "simulated times at which feedback.tau changes, in order", "s", 0.0),
    Parameter("tau_change.values", [], f"factor from then on: {FACTORS}, a change after the other", "", 0.0, 1.0),
)


def rigid_factors(values: Sequence[float], name: str) -> np.ndarray:
    """Return the factors tau of the rigid states, shape (5,), from ``values``: one for all states, or one for each.

    Raises:
        ParameterError: The parameter ``name`` has another number of values, or one that is not above zero.
    """
    tau = np.array(values, float)
    if tau.shape not in ((1,), (N_RIGID,)):
        raise ParameterError(f"parameter {name}: {tau.size} values, expected 1 or {N_RIGID}")
    if not np.all(tau > 0.0):
        raise ParameterError(f"parameter {name} = {tau.tolist()}: expected values above zero")
    return np.broadcast_to(tau, N_RIGID).copy()


def certified(values: Sequence[float], minimum: np.ndarray, name: str = TAU.name) -> np.ndarray:
    """Return the factors tau (5) in ``values``, one or five, if they are certified.

    The certified factors lie on the straight line from ``minimum`` (5) to five ones: one Lyapunov function covers the
    closed loops along it. Factors near ``minimum`` for one state and near 1 for another are not on this line.

    Raises:
        ParameterError: The factors are not certified; the message says which are.
    """
    tau = rigid_factors(values, name)
    outside = np.flatnonzero(~((tau >= minimum) & (tau <= 1.0)))
    # One value for all states whose ranges differ: naming the range of one state would mislead.
    blurred = len(values) == 1 and np.ptp(minimum) > 0.0
    for index in [] if blurred else outside[:1]:
        place = f"[{index}]" if len(values) > 1 else ""
        low = float(minimum[index])
        expected = f"{low:g} to 1, the certified range" if low < 1.0 else "1: no other factor is certified"
        raise ParameterError(f"parameter {name}{place} = {tau[index]:g}: expected {expected} (feedback.tau_minimum)")
    lessened = minimum < 1.0
    share = (1.0 - tau[lessened]) / (1.0 - minimum[lessened])
    if outside.size or (share.size and np.ptp(share) > _SAME_SHARE):
        raise ParameterError(
            f"parameter {name} = {tau.tolist()}: expected factors that are all the same share of the way from 1 to "
            f"{compact(minimum).tolist()} (feedback.tau_minimum), no others are certified"
        )
    return tau


def compact(tau: np.ndarray) -> np.ndarray:
    """Return the factors ``tau`` (5) as an array of one value if all are equal, else a copy of all five."""
    return tau[:1].copy() if np.all(tau == tau[0]) else tau.copy()


def scheduled_changes(values: Mapping[str, Any], minimum: np.ndarray, period: float) -> list[tuple[int, np.ndarray]]:
    """Return the changes of tau that ``values`` schedule, as pairs of first step and factors tau (5).

    ``values`` are flat parameters, of which :data:`TAU_CHANGE_PARAMETERS` are used. ``minimum`` (5) are the smallest
    certified factors, ``period`` is the control period (s).

    Raises:
        ParameterError: The arrays do not match, times decrease, or a factor is not certified.
    """
    v = validate(TAU_CHANGE_PARAMETERS, values)
    starts, flat = v["tau_change.starts"], v["tau_change.values"]
    if len(flat) not in (len(starts), N_RIGID * len(starts)):
        raise ParameterError(
            f"parameter tau_change.values: {len(flat)} values, expected {len(starts)} or {N_RIGID * len(starts)}"
        )
    if starts != sorted(starts):
        raise ParameterError(f"parameter tau_change.starts = {starts}: expected times that do not decrease")
    rows = np.reshape(flat, (len(starts), -1)).tolist() if starts else []
    return [
        (first_step(start, period), certified(row, minimum, f"tau_change.values[{index}]"))
        for index, (start, row) in enumerate(zip(starts, rows, strict=True))
    ]


def change_parameters(changes: Sequence[tuple[int, np.ndarray]], period: float) -> dict[str, list[float]]:
    """Return :data:`TAU_CHANGE_PARAMETERS` for ``changes``; each change is a pair of first step and factors tau (5)."""
    return {
        "tau_change.starts": [start * period for start, _ in changes],
        "tau_change.values": [float(value) for _, tau in changes for value in tau],
    }


@dataclass(frozen=True)
class TubeSet:
    """The invariant set (e - c)' P (e - c) <= 1 for errors e (n) of the rigid states and the notch filter, SI.

    ``centre`` is c (n), ``shape`` P (n, n). ``half_width`` (n) is the certified bound of |e - c| by entry; for the
    rigid states it may be narrower than the set, see :class:`hsv.certificate.verification.StarNorms`. ``rates`` (2) are
    the largest rates of altitude (m/s) and velocity (m/s^2) for which the tightened bounds hold; empty: any rates.
    """

    centre: np.ndarray
    shape: np.ndarray
    half_width: np.ndarray
    rates: np.ndarray = field(default_factory=lambda: np.empty(0))

    def too_fast(self, change: np.ndarray, period: float) -> np.ndarray:
        """Return whether the ``change`` (2) of altitude (m) and velocity (m/s) in a ``period`` (s) exceeds the rates.

        The result is empty for a set that holds for any rates.
        """
        return np.abs(change[: len(self.rates)]) > self.rates * period * (1.0 + 1e-9)

    def farthest(self, error: np.ndarray) -> str:
        """Return the name of the component of e - c that is largest relative to its half-width, for an error e (n)."""
        with np.errstate(over="ignore"):
            index = int(np.argmax(np.abs(error - self.centre) / self.half_width))
        return STATE_NAMES[index] if index < N_RIGID else f"filter_{index - N_RIGID + 1}"


PLAN_SHIFT = 0.05
"""How far other plans stay below the largest inputs of the certified plans, as a share of the ranges of these inputs.

Without this distance the acceleration channel reaches 1.02 of its bound."""


@dataclass(frozen=True)
class PlanBounds:
    """Bounds of the total nominal input u_r + u_n and of the nominal pitch acceleration, SI.

    ``input_minimum`` and ``input_maximum`` (2) are the ends of U minus F Z; beyond them the feedback may saturate.
    ``region_minimum`` and ``region_maximum`` (3: both inputs, pitch acceleration) are the range of the certified
    plans; the range of each input is shifted down by :data:`PLAN_SHIFT`. Disturbances were measured along these plans;
    faster ones cause more.
    """

    input_minimum: np.ndarray
    input_maximum: np.ndarray
    region_minimum: np.ndarray
    region_maximum: np.ndarray

    @property
    def lower(self) -> np.ndarray:
        """Larger of ``input_minimum`` and ``region_minimum`` for each input (2)."""
        return np.maximum(self.input_minimum, self.region_minimum[:2])

    @property
    def upper(self) -> np.ndarray:
        """Smaller of ``input_maximum`` and ``region_maximum`` for each input (2)."""
        return np.minimum(self.input_maximum, self.region_maximum[:2])

    @property
    def pitch_acceleration(self) -> tuple[float, float]:
        """Minimum and maximum of the nominal pitch acceleration, rad/s^2."""
        return float(self.region_minimum[2]), float(self.region_maximum[2])


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
    Parameter("tube.rates", [], "largest certified rates of altitude (m/s) and velocity (m/s^2); empty: any"),
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
"""Parameters of a design, as the nodes declare them."""

NO_DESIGN = "none"
"""Value of ``design.name`` with which a node flies without a design; otherwise it would load its default one."""


def digest(values: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a design's flat parameters, in hexadecimal.

    ``design.hash`` itself and ``feedback.tau``, which may have any certified value, are left out. So are empty values,
    ``feedback.tau_minimum`` at its default, and ``nominal.filtered`` and ``nominal.interpolated`` if they are false.
    """
    known = {p.name for p in DESIGN_PARAMETERS} - {"design.hash", TAU.name}
    absent = {TAU_MINIMUM.name: TAU_MINIMUM.default, "nominal.filtered": False, "nominal.interpolated": False}
    said = {name: values[name] for name in sorted(known & values.keys()) if values[name] != absent.get(name, "")}
    text = json.dumps({name: value for name, value in said.items() if value != []})
    return hashlib.sha256(text.encode()).hexdigest()


def shaped(values: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the values of the parameter ``name`` as an array of the given ``shape``, in which one size may be -1.

    Raises:
        DesignError: The number of values does not fit the shape.
    """
    array = np.array(values[name], float)
    unit = int(np.prod([n for n in shape if n > 0]))
    if array.size == 0 or (array.size % unit if -1 in shape else array.size != unit):
        expected = f"a multiple of {unit}" if -1 in shape else str(unit)
        raise DesignError(f"parameter {name}: {array.size} values, expected {expected}")
    return np.ascontiguousarray(array.reshape(shape))


def positive(values: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the array of a parameter as :func:`shaped` does; a DesignError refuses values that are not positive."""
    array = shaped(values, name, shape)
    if not np.all(array > 0.0):
        raise DesignError(f"parameter {name} = {array.tolist()}: expected values above zero")
    return array


def samples(values: Mapping[str, Any], axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the breakpoints (n) of ``axis``, e.g. ``scheduling.altitude``, and the vertices' weights (n, v) there."""
    breakpoints = np.array(values[f"{axis}.breakpoints"], float)
    if len(breakpoints) < 2:
        raise DesignError(f"parameter {axis}.breakpoints: {len(breakpoints)} values, expected at least 2")
    return breakpoints, shaped(values, f"{axis}.weights", (len(breakpoints), -1))


@dataclass(frozen=True)
class ControlDesign:
    """The numbers of a Tube-MPC controller in flight, SI, with states in the order of :mod:`hsv.model.signals`.

    ``feedback_gain`` is F (2, 9). ``nominal_gains`` are K (g, 2, 9), outermost ellipsoid first, ``nominal_ellipsoids``
    the P (g, 5, 5) of their ellipsoids x' P x <= 1 of rigid states. ``nominal_state_scale`` (5) and
    ``nominal_input_scale`` (2) are deviations of equal nominal cost; ``nominal_input_bound`` (2) bounds |u_n| (eq. 35).
    ``input_minimum`` and ``input_maximum`` (2) limit u, and ``notch`` is the filter of the design. The samples of each
    scheduling axis are breakpoints (n) and, at them, the weights (n, v) of the axis' v vertices.
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
    """Set of inertial coupling for which the tube is certified; empty if the design has no tube."""
    actuators: tuple[str, ...] = ()
    """Names of the actuators for which the tube is certified; an input that none of them drives has an ideal one."""
    vehicle: str = ""
    """Digest of the vehicle of the design; empty: the default vehicle."""
    tube: TubeSet | None = None
    """The invariant set of the tube error, or ``None`` if the design has none."""
    plan_bounds: PlanBounds | None = None
    """Bounds of the total nominal input, or ``None`` if the design has no tightened bounds."""
    tau: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Factors tau (5) of the feedback of the rigid states in flight."""
    tau_minimum: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Smallest certified factors tau (5); the certificate covers the line from these factors to ones."""
    interpolated: bool = False
    """Whether the nominal gain is interpolated between two ellipsoids, which makes u_n continuous, or switched."""
    filtered: bool = False
    """Whether the pitch rate of the plan, which the feedback subtracts, passes the notch filter, too (eq. 48)."""
    modified: bool = False
    """Whether the parameters were changed after the design was written; their digest then differs from design.hash."""

    def adjusted_gain(self, tau: np.ndarray) -> np.ndarray:
        """Return F (2, 9) with the columns of the rigid states times their factors ``tau`` (5) (eq. 48, eq. 54)."""
        gain = self.feedback_gain.copy()
        gain[:, :N_RIGID] *= tau
        return gain

    def with_tau(self, values: Sequence[float]) -> Self:
        """Return a copy of the design with the factors tau in ``values``, one or five.

        Raises:
            ParameterError: The factors are not certified.
            DesignError: The closed loop with these factors is not stable.
        """
        tau = certified(TAU.check(values), self.tau_minimum)
        _check_stable(TAU.name, self.polytope, self.adjusted_gain(tau))
        return replace(self, tau=tau)

    @property
    def actuator_sets(self) -> tuple[ActuatorSet, ...]:
        """The data of the actuators for which the tube is certified."""
        return tuple(ACTUATOR_SETS[name] for name in self.actuators)

    @property
    def digest(self) -> str:
        """The digest of the current parameters, see :func:`digest`."""
        return str(self.to_parameters()["design.hash"])

    @property
    def loop_parameters(self) -> dict[str, Any]:
        """The flat parameters of the design that the whole loop uses: control period and notch filter."""
        columns = {f.name: [float(getattr(s, f.name)) for s in self.notch] for f in fields(NotchSection)}
        return {"period": self.period, **{f"notch.{name}": column for name, column in columns.items()}}

    def to_parameters(self) -> dict[str, Any]:
        """Return the flat ROS 2 parameters by name, with arrays as lists row by row, and the digest."""
        values: dict[str, Any] = {
            "design.name": self.name,
            **self.loop_parameters,
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
            carried = {f"tube.{name}": value for name, value in vars(self.tube).items() if len(value)}
            values |= {"design.coupling": self.coupling} | carried
        if self.plan_bounds:
            values |= {f"nominal.{name}": value for name, value in vars(self.plan_bounds).items()}
        flat = {
            name: np.asarray(value, float).ravel().tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
        }
        return {"design.hash": digest(flat), **flat}

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> Self:
        """Return the design in the flat parameters ``values``, after checking types, sizes, ranges and stability.

        Raises:
            DesignError: A parameter is wrong; the message names it and says what was expected.
        """
        try:
            v = validate(DESIGN_PARAMETERS, values)
            notch = flown_sections(v)
            discretise(notch, v["period"])  # refuses centre frequencies above the Nyquist frequency
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
"""Array fields of :class:`ControlDesign` that every design has, with the name and shape of their parameters."""

_POSITIVE = ("nominal_state_scale", "nominal_input_scale", "nominal_input_bound")


def design_of(values: Mapping[str, Any]) -> ControlDesign | None:
    """Return the design in the flat parameters of a flight, or ``None`` if they contain no design."""
    flown_with_any = {parameter.name for parameter in (*DESIGN_NOTCH_PARAMETERS, TAU)}
    known = [parameter.name for parameter in DESIGN_PARAMETERS if parameter.name not in flown_with_any]
    if values.get("design.name") == NO_DESIGN or not any(name in values for name in known):
        return None
    return ControlDesign.from_parameters(values)


def _tube(values: Mapping[str, Any], n: int) -> TubeSet | None:
    if not any(values[f"tube.{name}"] for name in ("centre", "shape", "half_width")):
        return None
    shape = shaped(values, "tube.shape", (n, n))
    if not (np.allclose(shape, shape.T, rtol=1e-9, atol=0.0) and np.linalg.eigvalsh(shape)[0] > 0.0):
        raise DesignError("parameter tube.shape: expected a symmetric positive definite matrix")
    rates = positive(values, "tube.rates", (2,)) if values["tube.rates"] else np.empty(0)
    return TubeSet(shaped(values, "tube.centre", (n,)), shape, positive(values, "tube.half_width", (n,)), rates)


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
    # All nine poles must lie inside the unit circle, also those of the flexible states, which are not fed back.
    for vertex, (a, b) in enumerate(zip(polytope.A, polytope.B, strict=True)):
        with np.errstate(over="ignore", invalid="ignore"):
            closed = a + b @ gain
        finite = np.all(np.isfinite(closed))
        radius = float(np.max(np.abs(np.linalg.eigvals(closed)))) if finite else np.inf
        if not radius < 1.0:
            raise DesignError(
                f"parameter {name}: spectral radius {radius:.6f} of the closed loop at vertex {vertex}, "
                "expected below 1"
            )

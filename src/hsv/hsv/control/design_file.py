"""A controller design as it flies: read from, and written to, ROS 2 parameter YAML."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hsv.control.adjustable import TAU, TAU_MINIMUM, certified, compact, factors
from hsv.control.notch_filter import DESIGN_NOTCH_PARAMETERS, NotchFilter, NotchSection
from hsv.control.plan_bounds import PlanBounds
from hsv.control.tube_set import TubeSet
from hsv.errors import DesignError, ParameterError
from hsv.lpv.polytope import INTERPOLATIONS, Polytope, axis_weights
from hsv.parameters import Parameter, check_all
from hsv.vehicle.dynamics import N_INPUTS, N_RIGID, N_STATES

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
    Parameter("nominal.filtered", False, "feedback on q_f less the filtered rate of the plan (paper eq. 48)"),
    Parameter("nominal.gains", [], "nominal gains K, each 2 x 9, row by row, outermost ellipsoid first (SI)"),
    Parameter("nominal.ellipsoids", [], "P of x' P x <= 1 on the rigid states, each 5 x 5, outermost first (SI)"),
    Parameter("design.coupling", "", "set of inertial coupling of the vehicle that the tube is certified for"),
    Parameter("design.vehicle", "", "digest of the vehicle that the design is for; empty: the default one"),
    Parameter("tube.centre", [], "centre c of the invariant set: five rigid states, then the notch filter's (SI)"),
    Parameter("tube.shape", [], "P of (e - c)' P (e - c) <= 1, row by row (SI); empty: the design carries no set"),
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
"""What a design brings to the nodes."""


@dataclass(frozen=True)
class ControlDesign:
    """The numbers a Tube-MPC controller flies with, SI, state order as in :mod:`hsv.vehicle.dynamics`.

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
    vehicle: str = ""
    """Digest of the vehicle that the design is for, empty: the default one."""
    tube: TubeSet | None = None
    """The invariant set of the tube error, ``None``: the design carries none."""
    plan_bounds: PlanBounds | None = None
    """What a nominal plan may use, ``None``: the design carries no tightened inputs."""
    tau: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Factor (5) of each rigid state's feedback that the design flies with."""
    tau_minimum: np.ndarray = field(default_factory=lambda: np.ones(N_RIGID))
    """Least factor (5) for which the feedback is certified, up to 1."""
    filtered: bool = False
    """Whether the feedback acts on the filtered pitch rate less that of the plan through the same filter (eq. 48)."""
    modified: bool = False
    """Whether the parameters differ from those that were written (their digest does not match)."""

    def adjusted_gain(self, tau: np.ndarray) -> np.ndarray:
        """Return F (2, 9) with each rigid state's column times its factor ``tau`` (5) (paper eq. 48, eq. 54)."""
        gain = self.feedback_gain.copy()
        gain[:, :N_RIGID] *= tau
        return gain

    def to_parameters(self) -> dict[str, Any]:
        """Return the flat ROS 2 parameters, digest included."""
        values: dict[str, Any] = {
            "design.name": self.name,
            "period": self.period,
            "notch.zero_frequency": np.array([s.zero_frequency for s in self.notch]),
            "notch.zero_damping": np.array([s.zero_damping for s in self.notch]),
            "notch.pole_frequency": np.array([s.pole_frequency for s in self.notch]),
            "notch.pole_damping": np.array([s.pole_damping for s in self.notch]),
            "model.a": self.polytope.A,
            "model.b": self.polytope.B,
            "scheduling.interpolation": self.interpolation,
            "scheduling.altitude.breakpoints": self.altitude_samples[0],
            "scheduling.altitude.weights": self.altitude_samples[1],
            "scheduling.velocity.breakpoints": self.velocity_samples[0],
            "scheduling.velocity.weights": self.velocity_samples[1],
            "feedback.gain": self.feedback_gain,
            "nominal.gains": self.nominal_gains,
            "nominal.ellipsoids": self.nominal_ellipsoids,
            "nominal.state_scale": self.nominal_state_scale,
            "nominal.input_scale": self.nominal_input_scale,
            "nominal.input_bound": self.nominal_input_bound,
            "input.minimum": self.input_minimum,
            "input.maximum": self.input_maximum,
        }
        adjustable = {"feedback.tau": self.tau, "feedback.tau_minimum": self.tau_minimum}
        values |= {name: compact(tau) for name, tau in adjustable.items() if np.any(tau != 1.0)}
        if self.filtered:
            values["nominal.filtered"] = True
        if self.vehicle:
            values["design.vehicle"] = self.vehicle
        if self.tube:
            tube = {"centre": self.tube.centre, "shape": self.tube.shape, "half_width": self.tube.half_width}
            values |= {"design.coupling": self.coupling} | {f"tube.{name}": value for name, value in tube.items()}
        if self.plan_bounds:
            values |= {f"nominal.{name}": value for name, value in vars(self.plan_bounds).items()}
        flat = {
            name: np.asarray(value, float).ravel().tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
        }
        return {"design.hash": digest(flat), **flat}

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any]) -> ControlDesign:
        """Return the design in ``values``, checked: types, sizes, finite numbers, and a stable closed loop.

        Raises:
            DesignError: Names the parameter that is wrong and what was expected.
        """
        try:
            v = check_all(DESIGN_PARAMETERS, values)
            notch = NotchFilter.from_parameters({**v, "notch.enabled": True})
            tau_minimum = factors(v["feedback.tau_minimum"], "feedback.tau_minimum")
            tau = certified(v["feedback.tau"], tau_minimum)
        except ParameterError as error:
            raise DesignError(str(error)) from error
        altitude = _samples(v, "scheduling.altitude")
        velocity = _samples(v, "scheduling.velocity")
        vertices = altitude[1].shape[1] * velocity[1].shape[1]
        try:
            axes = [axis_weights(*samples, v["scheduling.interpolation"]) for samples in (altitude, velocity)]
        except DesignError as error:
            raise DesignError(f"parameter scheduling.*: {error}") from error
        A = _shaped(v, "model.a", (vertices, N_STATES, N_STATES))
        B = _shaped(v, "model.b", (vertices, N_STATES, N_INPUTS))
        F = _shaped(v, "feedback.gain", (N_INPUTS, N_STATES))
        design = cls(
            name=v["design.name"],
            period=v["period"],
            polytope=Polytope(A, B, axes[0], axes[1]),
            interpolation=v["scheduling.interpolation"],
            altitude_samples=altitude,
            velocity_samples=velocity,
            feedback_gain=F,
            nominal_gains=_shaped(v, "nominal.gains", (-1, N_INPUTS, N_STATES)),
            nominal_ellipsoids=_shaped(v, "nominal.ellipsoids", (-1, N_RIGID, N_RIGID)),
            nominal_state_scale=_positive(v, "nominal.state_scale", N_RIGID),
            nominal_input_scale=_positive(v, "nominal.input_scale", N_INPUTS),
            nominal_input_bound=_positive(v, "nominal.input_bound", N_INPUTS),
            input_minimum=_shaped(v, "input.minimum", (N_INPUTS,)),
            input_maximum=_shaped(v, "input.maximum", (N_INPUTS,)),
            notch=notch.sections,
            coupling=v["design.coupling"],
            vehicle=v["design.vehicle"],
            tube=_tube(v, N_RIGID + 2 * len(notch.sections)),
            plan_bounds=_plan_bounds(v),
            tau=tau,
            tau_minimum=tau_minimum,
            filtered=v["nominal.filtered"],
            modified=v["design.hash"] != digest(v),
        )
        if len(design.nominal_gains) != len(design.nominal_ellipsoids):
            raise DesignError(
                f"parameter nominal.ellipsoids: {len(design.nominal_ellipsoids)} matrices, "
                f"expected one per gain, {len(design.nominal_gains)}"
            )
        if not np.all(design.input_minimum < design.input_maximum):
            raise DesignError("parameter input.minimum: expected values below input.maximum")
        _check_stable("feedback.gain", A, B, F)
        _check_stable("feedback.tau", A, B, design.adjusted_gain(tau))
        for gain in design.nominal_gains:
            _check_stable("nominal.gains", A, B, gain)
        return design


NO_DESIGN = "none"
"""Name of the design in the parameters of a node that flies without one: nodes have a default."""


def design_of(values: Mapping[str, Any]) -> ControlDesign | None:
    """Return the design in the flat parameters of a flight, ``None`` where there is none.

    Raises:
        DesignError: As :meth:`ControlDesign.from_parameters`.
    """
    if values.get("design.name") == NO_DESIGN:
        return None
    flown_with_any = {parameter.name for parameter in DESIGN_NOTCH_PARAMETERS}
    brought = {parameter.name for parameter in DESIGN_PARAMETERS} - flown_with_any - {TAU.name}
    return ControlDesign.from_parameters(values) if brought & values.keys() else None


def digest(values: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a design's flat parameters.

    Left out are ``design.hash``, ``feedback.tau``, which may be anything certified, and what is empty or as if absent.
    """
    known = {p.name for p in DESIGN_PARAMETERS} - {"design.hash", TAU.name}
    absent = {TAU_MINIMUM.name: TAU_MINIMUM.default, "nominal.filtered": False}
    said = {name: values[name] for name in sorted(known & values.keys()) if values[name] != absent.get(name, "")}
    text = json.dumps({name: value for name, value in said.items() if value != []})
    return hashlib.sha256(text.encode()).hexdigest()


def write_design(path: Path, design: ControlDesign, comment: str) -> None:
    """Write ``design`` as ROS 2 parameter YAML for all nodes, with ``comment`` lines on top."""
    tree: dict[str, Any] = {}
    for name, value in design.to_parameters().items():
        *groups, leaf = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[leaf] = value
    header = "".join(f"# {line}\n" for line in comment.splitlines())
    body = yaml.dump({"/**": {"ros__parameters": tree}}, sort_keys=False, default_flow_style=None, width=120)
    path.write_text(header + body, encoding="utf-8")


def read_parameters(path: Path, node: str = "") -> dict[str, Any]:
    """Return the flat parameters for ``node`` in a ROS 2 parameter YAML: its own section over the one for all nodes.

    Raises:
        DesignError: The file is missing or is not parameter YAML.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not text"
        raise DesignError(f"design {str(path)!r}: cannot be read ({reason}), expected a parameter file") from error
    return parse_parameters(text, str(path), node)


def parse_parameters(text: str, source: str, node: str = "") -> dict[str, Any]:
    """Return the flat parameters in the ``text`` of a parameter YAML, as :func:`read_parameters`.

    Raises:
        DesignError: The text is not parameter YAML; the message names ``source``.
    """
    sections = parse_sections(text, source)
    flat: dict[str, Any] = {}
    for section in ("/**", node, f"/{node}"):
        flat |= sections.get(section, {})
    if not flat:
        raise _no_parameters(source)
    return flat


def parse_sections(text: str, source: str) -> dict[str, dict[str, Any]]:
    """Return the flat parameters of every section in the ``text`` of a parameter YAML, ``"/**"`` for all nodes.

    Raises:
        DesignError: As :func:`parse_parameters`.
    """
    try:
        tree = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except yaml.YAMLError as error:
        raise DesignError(f"design {source!r}: {' '.join(str(error).split())}") from error
    sections: dict[str, dict[str, Any]] = {}
    for section, branch in tree.items() if isinstance(tree, dict) else ():
        if isinstance(branch, dict) and isinstance(branch.get("ros__parameters"), dict):
            _flatten(branch["ros__parameters"], "", sections.setdefault(str(section), {}))
    if not any(sections.values()):
        raise _no_parameters(source)
    return sections


def _no_parameters(source: str) -> DesignError:
    return DesignError(f"design {source!r}: expected ROS 2 parameters ('/**': 'ros__parameters': ...)")


def read_design(path: Path) -> ControlDesign:
    """Return the design in a parameter file; errors name the file and the parameter (see :class:`ControlDesign`)."""
    return _design_in(path, read_parameters(path))


def read_design_parameters(path: Path) -> dict[str, Any]:
    """Return the flat parameters in a parameter file that :func:`read_design` accepts, with its errors."""
    values = read_parameters(path)
    _design_in(path, values)
    return values


def _design_in(path: Path, values: Mapping[str, Any]) -> ControlDesign:
    try:
        return ControlDesign.from_parameters(values)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error


def find_design(name: str) -> Path:
    """Return the parameter file of a design given by path, or by name in ``HSV_DESIGN_PATH`` or the source checkout.

    Raises:
        DesignError: No such file.
    """
    return find_file(name, ".yaml")


def find_file(name: str, suffix: str) -> Path:
    """Return a design's file of the given ``suffix``; see :func:`find_design`."""
    if "/" in name or name.endswith(suffix):
        candidates = [Path(name)]
    else:
        folders = [Path(folder) for folder in os.environ.get("HSV_DESIGN_PATH", "").split(os.pathsep) if folder]
        # A source checkout, or a symlinked build of one, has the designs beside it.
        folders += [parent / "offline_design" for parent in Path(__file__).resolve().parents]
        candidates = [folder / f"{name}{suffix}" for folder in folders]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise DesignError(
        f"design = {name!r}: no such file, expected the path of a {suffix} file or a name in HSV_DESIGN_PATH"
    )


def _flatten(branch: Mapping[str, Any], prefix: str, into: dict[str, Any]) -> None:
    for name, value in branch.items():
        if isinstance(value, dict):
            _flatten(value, f"{prefix}{name}.", into)
        else:
            into[f"{prefix}{name}"] = value


def _shaped(values: Mapping[str, Any], name: str, shape: tuple[int, ...]) -> np.ndarray:
    array = np.array(values[name], float)
    unit = int(np.prod([n for n in shape if n > 0]))
    if array.size == 0 or (array.size % unit if -1 in shape else array.size != unit):
        expected = f"a multiple of {unit}" if -1 in shape else str(unit)
        raise DesignError(f"parameter {name}: {array.size} values, expected {expected}")
    return np.ascontiguousarray(array.reshape(shape))


def _positive(values: Mapping[str, Any], name: str, size: int) -> np.ndarray:
    array = _shaped(values, name, (size,))
    if not np.all(array > 0.0):
        raise DesignError(f"parameter {name} = {array.tolist()}: expected values above zero")
    return array


def _samples(values: Mapping[str, Any], axis: str) -> tuple[np.ndarray, np.ndarray]:
    breakpoints = np.array(values[f"{axis}.breakpoints"], float)
    if len(breakpoints) < 2:
        raise DesignError(f"parameter {axis}.breakpoints: {len(breakpoints)} values, expected at least 2")
    return breakpoints, _shaped(values, f"{axis}.weights", (len(breakpoints), -1))


def _tube(values: Mapping[str, Any], n: int) -> TubeSet | None:
    if not any(values[f"tube.{name}"] for name in ("centre", "shape", "half_width")):
        return None
    shape = _shaped(values, "tube.shape", (n, n))
    if not (np.allclose(shape, shape.T, rtol=1e-9, atol=0.0) and np.linalg.eigvalsh(shape)[0] > 0.0):
        raise DesignError("parameter tube.shape: expected a symmetric positive definite matrix")
    return TubeSet(_shaped(values, "tube.centre", (n,)), shape, _shaped(values, "tube.half_width", (n,)))


def _plan_bounds(values: Mapping[str, Any]) -> PlanBounds | None:
    sizes = {"input_minimum": 2, "input_maximum": 2, "region_minimum": 3, "region_maximum": 3}
    if not any(values[f"nominal.{name}"] for name in sizes):
        return None
    bounds = PlanBounds(**{name: _shaped(values, f"nominal.{name}", (size,)) for name, size in sizes.items()})
    for name in ("input", "region"):
        if not np.all(getattr(bounds, f"{name}_minimum") < getattr(bounds, f"{name}_maximum")):
            raise DesignError(f"parameter nominal.{name}_minimum: expected values below nominal.{name}_maximum")
    return bounds


def _check_stable(name: str, A: np.ndarray, B: np.ndarray, gain: np.ndarray) -> None:
    # The flexible states follow the rigid ones and have poles of their own: all nine must be inside the unit circle.
    for vertex, (a, b) in enumerate(zip(A, B, strict=True)):
        radius = float(np.max(np.abs(np.linalg.eigvals(a + b @ gain))))
        if not radius < 1.0:
            raise DesignError(
                f"parameter {name}: spectral radius {radius:.6f} of the closed loop at vertex {vertex}, "
                "expected below 1"
            )

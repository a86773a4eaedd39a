"""The baseline design (paper section 3): gains and tube of a Tube-MPC controller, and the evidence for them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np

from hsv.base.errors import DesignError
from hsv.base.processes import Progress
from hsv.certificate.loops import vertex_loops
from hsv.certificate.margin_checks import margins_report
from hsv.certificate.margins import disk_margin
from hsv.control.design import ControlDesign
from hsv.control.design_file import FORMAT
from hsv.control.notch_filter import NotchSection
from hsv.design.feedback import FeedbackGain, feedback_gain
from hsv.design.inputs import DesignInputs
from hsv.design.model import DesignModel, design_model
from hsv.design.tightening import TightenedInputs
from hsv.design.tube import design_tube
from hsv.lmi.nominal_gain import NominalGain, NominalProblem, nested_gains, step_deviation
from hsv.lmi.semidefinite import inverse, spectral_radii
from hsv.model.lpv.linearisation import linearise, zero_order_hold
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES
from hsv.model.trim import trim


@dataclass(frozen=True)
class DesignResult:
    """A design with its polytopic model and its report (SI, ready for JSON)."""

    design: ControlDesign
    model: DesignModel
    report: dict[str, Any]


def design_baseline(inputs: DesignInputs, progress: Progress | None = None) -> DesignResult:
    """Return the baseline design (paper section 3) with its tube: gains, disturbance set, invariant set, input bounds.

    The report is the certificate; on one machine, the same inputs always give the same report.

    Args:
        inputs: Design inputs, from :func:`hsv.design.inputs.read_inputs`.
        progress: Called with the name of a stage, the number of its parts that are done, and their total number.

    Raises:
        DesignError: A problem has no solution, a solution fails when recomputed, a flight diverges or saturates an
            input, or the nominal plan does not fit into the tightened inputs.
        TrimError: A flight point of ``inputs`` cannot be trimmed.
    """
    tell = progress or (lambda stage, done, total: None)
    gains = design_gains(inputs, tell)
    tube = design_tube(gains.design, inputs, tell)
    if inputs.tightening.chain == "literal":
        literal = _literal(inputs, tube.bounds)
        try:
            gains = design_gains(literal, tell)
            tube = design_tube(gains.design, literal, tell)
        except DesignError as error:
            bound = literal.nominal.input_bound.array().tolist()
            raise DesignError(f"literal chain (30) to (35), |u_n| at most {bound}: {error}") from error
    design = replace(gains.design, coupling=inputs.disturbance.coupling, tube=tube.found.seen(), plan_bounds=tube.plan)
    report = {
        **gains.report,
        "tube": tube.report,
        "margins": margins_report(design, inputs.flown_vehicle, gains.report["inputs"], tell),
        "parameters_sha256": design.to_parameters()["design.hash"],
    }
    return DesignResult(design, gains.model, report)


def require_margins(inputs: DesignInputs, design: ControlDesign) -> None:
    """Refuse a design whose disk margin is below the required one at a vertex.

    Raises:
        DesignError: The message names the loop and the vertex.
    """
    for name, required in inputs.margins.model_dump(exclude_none=True).items():
        found = [disk_margin(loop.broken(name)).margin for loop in vertex_loops(design)]
        if (least := min(found)) < required:
            raise DesignError(
                f"margins.{name} = {required:g}: the loop has a disk margin of {least:.3f} at vertex "
                f"{found.index(least)}, expected at least {required:g}"
            )


def versions() -> list[str]:
    """Return the names and versions of the packages with which a design is computed."""
    return [f"{package} {version(package)}" for package in ("numpy", "scipy", "cvxpy", "clarabel")]


def design_gains(inputs: DesignInputs, progress: Progress | None = None) -> DesignResult:
    """Return the baseline design without its tube: polytopic model, feedback gain F, nominal gains K.

    Arguments and errors are those of :func:`design_baseline`.
    """
    tell = progress or (lambda stage, done, total: None)
    vehicle = inputs.flown_vehicle

    tell("polytopic model", 0, 1)
    notch = tuple(NotchSection(**section.model_dump()) for section in inputs.notch)
    model = design_model(inputs.model, vehicle, notch)
    polytope = model.polytope
    # In the decoupled model the flexible states do not act on the rigid ones; the gains act on the rigid ones only.
    A, B = polytope.A[:, :N_RIGID, :N_RIGID], polytope.B[:, :N_RIGID]
    tell("polytopic model", 1, 1)

    tell("feedback gain", 0, 1)
    feedback = feedback_gain(
        A,
        B,
        disturbance_columns(inputs),
        inputs.feedback.state_scale.array(),
        inputs.feedback.input_scale.array(),
        inputs.feedback.method,
    )
    tell("feedback gain", 1, 1)

    problem = nominal_problem(inputs, polytope, inputs.nominal.input_bound.array())
    nominal = nominal_family(inputs, problem, tell)

    design = ControlDesign(
        name=inputs.name,
        period=inputs.model.period,
        polytope=polytope,
        interpolation=model.found.interpolation,
        altitude_samples=model.found.samples[0],
        velocity_samples=model.found.samples[1],
        feedback_gain=_all_states(feedback.F),
        nominal_gains=np.stack([_all_states(gain.K) for gain in nominal]),
        nominal_ellipsoids=np.stack([inverse(gain.Q) for gain in nominal]),
        nominal_state_scale=problem.state_scale,
        nominal_input_scale=problem.input_scale,
        nominal_input_bound=problem.input_bound,
        input_minimum=vehicle.decoupled.input_minimum,
        input_maximum=vehicle.decoupled.input_maximum,
        notch=notch,
        actuators=inputs.actuators,
        vehicle=vehicle.digest,
        interpolated=bool(inputs.nominal.interpolated),
    )
    require_margins(inputs, design)
    return DesignResult(design, model, _report(inputs, design, model, feedback, nominal))


def nominal_problem(inputs: DesignInputs, polytope: Polytope, input_bound: np.ndarray) -> NominalProblem:
    """Return the problem of the gains K on rigid states (eq. 31 to 35); ``input_bound``, shape (2,), limits |u_n|."""
    return NominalProblem(
        polytope.A[:, :N_RIGID, :N_RIGID],
        polytope.B[:, :N_RIGID],
        inputs.model.period,
        inputs.nominal.state_scale.array(),
        inputs.nominal.input_scale.array(),
        input_bound,
    )


def nominal_family(inputs: DesignInputs, problem: NominalProblem, progress: Progress) -> list[NominalGain]:
    """Return one nominal gain for each scale of x_n(0) in the inputs, outermost first; errors: :func:`nested_gains`."""
    deviation = initial_deviation(inputs)
    return nested_gains(
        problem,
        deviation,
        inputs.nominal.scales,
        interpolated=bool(inputs.nominal.interpolated),
        progress=lambda done, total: progress("nominal gains", done, total),
    )


def with_family(design: ControlDesign, problem: NominalProblem, gains: list[NominalGain]) -> ControlDesign:
    """Return ``design`` with the nominal ``gains`` and the input bound of their ``problem``."""
    return replace(
        design,
        nominal_gains=np.stack([_all_states(gain.K) for gain in gains]),
        nominal_ellipsoids=np.stack([inverse(gain.Q) for gain in gains]),
        nominal_input_bound=problem.input_bound,
    )


def initial_deviation(inputs: DesignInputs) -> np.ndarray:
    """Return x_n(0), shape (5,), for a step command from start to target: trim at start minus trim at target, SI."""
    start, target = inputs.nominal.start, inputs.nominal.target
    points = (start.altitude, start.velocity), (target.altitude, target.velocity)
    return step_deviation(inputs.flown_vehicle.decoupled, *points)


def disturbance_columns(inputs: DesignInputs) -> np.ndarray:
    """Return the disturbances that F attenuates, as changes of the rigid states per period, shape (5, 4), SI.

    The columns are the effect of losing a share of the trim elevator deflection, then those of constant errors in the
    derivatives of velocity, angle of attack and pitch rate, all linearised at mid-envelope.
    """
    vehicle, centre = inputs.flown_vehicle.decoupled, inputs.flown_vehicle.centre
    A, B = (matrix[:N_RIGID] for matrix in linearise(vehicle, *centre))
    d = inputs.feedback.disturbance
    fault = B[:, 1:] * d.elevator_loss * trim(vehicle, *centre).input[1]
    channels = np.zeros((N_RIGID, 3))
    channels[[1, 2, 4], [0, 1, 2]] = d.acceleration, d.angle_of_attack_rate, d.pitch_acceleration
    return zero_order_hold(A[:, :N_RIGID], np.hstack((fault, channels)), inputs.model.period)[1]


def _literal(inputs: DesignInputs, bounds: TightenedInputs) -> DesignInputs:
    """Return ``inputs`` with the largest |u_n| (eq. 35) for which u_n plus the target's trim stays in ``bounds``."""
    target = inputs.nominal.target
    bound = bounds.symmetric(trim(inputs.flown_vehicle.decoupled, target.altitude, target.velocity).input)
    if not bound.min() > 0.0:
        raise DesignError(f"literal chain (30) to (35): |u_n| at most {bound.tolist()}, expected above zero")
    values = {"fuel_equivalence_ratio": float(bound[0]), "elevator_deflection": float(bound[1])}
    size = inputs.nominal.input_bound.model_copy(update=values)
    return inputs.model_copy(update={"nominal": inputs.nominal.model_copy(update={"input_bound": size})})


def _all_states(gain: np.ndarray) -> np.ndarray:
    full = np.zeros((N_INPUTS, N_STATES))
    full[:, :N_RIGID] = gain
    return full


def _report(
    inputs: DesignInputs, design: ControlDesign, model: DesignModel, feedback: FeedbackGain, nominal: list[NominalGain]
) -> dict[str, Any]:
    A, B = design.polytope.A, design.polytope.B
    return {
        "format": FORMAT,
        "name": inputs.name,
        "units": "SI",
        "inputs": inputs.report(),
        "versions": versions(),
        "vertices": len(A),
        "model": model.report,
        "feedback": {
            **feedback.report(),
            "spectral_radius_all_states": float(spectral_radii(A + B @ design.feedback_gain).max()),
        },
        "nominal": nominal_report(inputs, design, nominal),
    }


def nominal_report(inputs: DesignInputs, design: ControlDesign, nominal: list[NominalGain]) -> list[dict[str, Any]]:
    """Return one entry for each nominal gain of ``design``, with its scale and its evidence, for JSON."""
    A, B = design.polytope.A, design.polytope.B
    return [
        {"scale": scale, **gain.report(), "spectral_radius_all_states": float(spectral_radii(A + B @ K).max())}
        for scale, gain, K in zip(inputs.nominal.scales, nominal, design.nominal_gains, strict=True)
    ]

"""Independent verification of a design: recompute the statements of its certificate with numpy.

This module imports no code that computes designs. It shares with that code only the vehicle model (:mod:`hsv.model`),
the discretisation of the notch filter (:mod:`hsv.control.notch_filter`), the reading of the files, and names. The
numbers in flight (vertices A_i, B_i, gains F and K) come from the design file, the statements about them from the
certificate. The vertices are recomputed from the parameters of the vehicle, and every inequality from its matrices.
:mod:`hsv.flight.flown_checks` repeats the flights, and :data:`hsv.certificate.checks.STATED` names the fields that
no check covers. The parts follow the paper: model (eq. 10 to 12), gain F (eq. 24), gains K (eq. 31 to 35), error system
(eq. 22, 23), invariant set (eq. 25 to 28), tightened bounds (eq. 30), adjustable factor (eq. 47 to 54).

The matrix inequalities are checked as bounds on singular values. With Q = L L', a matrix M maps the ellipsoid
x' Q^-1 x <= 1 into itself if and only if the largest singular value of L^-1 M L is at most 1; see :func:`image_norms`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hsv.base.errors import DesignError
from hsv.certificate.checks import (
    Check,
    Checks,
    Subject,
    above,
    at_least,
    at_most,
    equal,
    gathered,
    leaves,
    parameter,
    recomputed,
    required,
    same,
    under,
)
from hsv.certificate.convolution import LONGEST, rated_bounds
from hsv.certificate.coverage import only_share
from hsv.certificate.tolerances import ACCURACY, ROUNDING
from hsv.control.design import PLAN_SHIFT, ControlDesign
from hsv.control.design_file import FORMAT, find_certificate, read_certificate
from hsv.control.notch_filter import continuous, discretise, series
from hsv.model.lpv.actuated import actuator_names, sampled_actuators
from hsv.model.lpv.linearisation import (
    Filter,
    acceleration_channels,
    extended_jacobian,
    extended_state,
    from_true_rate,
    zero_order_hold,
)
from hsv.model.signals import (
    CHANNELS,
    INPUT_NAMES,
    N_INPUTS,
    N_RIGID,
    N_STATES,
    PITCH_RATE,
    STATE_NAMES,
)
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle, load_vehicle, vehicle_names

if TYPE_CHECKING:
    from hsv.model.lpv.polytopic import PolytopicModel

_LONGEST = 10_000
"""Maximum length of a counter-example, steps."""

FLOWN_FIELDS = (
    *under("inputs.disturbance", ("fault_start", "duration", "elevator_effectiveness")),
    *under("inputs.disturbance.ramp", ("start", "end", "blend")),
    *under("tube.disturbance", ("flights", *under("measured", ("lower", "upper", "lower_flight", "upper_flight")))),
    *under("tube.tightening.plan", ("lowest_flight", "highest_flight")),
    *under("tube.flights", ("flights", "steps", "nominal_fingerprint", "outside", "channel", "step")),
    *under("tube.flights", ("worst_level", "worst_level_flight", "worst_ratio", "worst_ratio_flight")),
    *under("adjustable.complete_fault", ("flights", "worst_level", "worst_level_flight")),
)
"""Fields that only flights can check."""


# --- algebra ----------------------------------------------------------------------------------------------------------


def image_norms(Q: np.ndarray, M: np.ndarray, *columns: np.ndarray) -> np.ndarray:
    """Return, for each M (..., n, n), the largest singular value of L^-1 [M L, columns] with Q = L L' (n, n).

    If it is at most 1, then M x + columns d lies in the ellipsoid {x: x' Q^-1 x <= 1} for all x and d that satisfy
    x' Q^-1 x + d' d <= 1.
    """
    L = np.linalg.cholesky(Q)
    return np.asarray(np.linalg.norm(np.linalg.solve(L, np.concatenate((M @ L, *columns), axis=-1)), 2, axis=(-2, -1)))


def ellipsoid_levels(Q: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return x' Q^-1 x, the level of ``x`` (n) in the ellipsoid of ``Q`` (n, n): 1 on its boundary."""
    return np.asarray(np.sum(np.linalg.solve(np.linalg.cholesky(Q), x.T) ** 2, axis=0))


def radii(M: np.ndarray) -> np.ndarray:
    """Return the spectral radius (r) of each matrix in ``M`` (r, n, n)."""
    return np.asarray(np.abs(np.linalg.eigvals(M)).max(axis=-1))


def inverse(Q: np.ndarray) -> np.ndarray:
    """Return the inverse of ``Q`` (n, n), made exactly symmetric."""
    P = np.linalg.inv(Q)
    return np.asarray(0.5 * (P + P.T))


def quotient(M: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Return M N^-1, from M (2, 5) and N (5, 5), as a gain (2, 9) that is zero on the flexible states."""
    scale = np.sqrt(np.diag(N))
    gain = np.zeros((len(M), N_STATES))
    gain[:, :N_RIGID] = np.linalg.solve(N / np.outer(scale, scale), (M / scale).T).T / scale
    return gain


def sizes(table: Mapping[str, float], names: Sequence[str]) -> np.ndarray:
    """Return the values of ``table`` as an array, in the order of ``names``."""
    return np.array([table[name] for name in names])


# --- statement and inputs ---------------------------------------------------------------------------------------------


def statement_checks(subject: Subject) -> Checks:
    """Compare name, units, number of vertices and the digest of the design file, which replaces no check of numbers.

    Check also whether the design is certified for all of W: a share of it bounds no flight that leaves the share.
    """
    design = subject.design
    yield equal(subject, "format", FORMAT)
    yield equal(subject, "name", design.name)
    yield equal(subject, "inputs.name", design.name)
    yield equal(subject, "units", "SI")
    yield equal(subject, "parameters_sha256", design.digest)
    yield recomputed(subject, "vertices", len(design.polytope.A), "copied")
    partial_set = only_share(subject.certificate)
    yield Check("share of W", partial_set or "all of W", "all of W", not partial_set)


def input_checks(subject: Subject) -> Checks:
    """Check what the design copies from its inputs, and that the scheduling weights of each axis are convex.

    The copies are period (eq. 12), notch filter (eq. 38), U (eq. 29), vehicle, inertial coupling and actuators. Convex
    weights sum to one (eq. 11), and none is negative (eq. 12).
    """
    design, inputs = subject.design, subject.certificate["inputs"]
    yield from _vehicle_checks(subject)
    yield recomputed(subject, "inputs.model.period", design.period, "copied")
    for i, section in enumerate(design.notch):
        for name, value in vars(section).items():
            yield recomputed(subject, f"inputs.notch.{i}.{name}", value, "copied")
    check = same("notch, sections", len(design.notch), len(inputs["notch"]), "copied")
    yield replace(check, fields=() if design.notch else ("inputs.notch",))
    yield equal(subject, "inputs.disturbance.coupling", design.coupling)
    known = " ".join(name for name in (inputs.get("actuator") or {}).values() if name)
    given = " ".join(design.actuators)
    fields = under("inputs.actuator", inputs.get("actuator") or ())
    yield Check("design.actuators", given, repr(known), given == known, required=True, fields=fields)
    limits, digest = subject.vehicle.decoupled, subject.vehicle.digest
    yield Check("design.vehicle", design.vehicle, repr(digest), design.vehicle == digest)
    yield parameter(subject, "input.minimum", design.input_minimum, limits.input_minimum)
    yield parameter(subject, "input.maximum", design.input_maximum, limits.input_maximum)
    for axis, (_, weights) in (("altitude", design.altitude_samples), ("velocity", design.velocity_samples)):
        sums = weights.sum(axis=1)
        yield same(f"scheduling.{axis}.weights, sums", sums, np.ones_like(sums), "sums")
        yield above(f"scheduling.{axis}.weights, least", weights.min(), -ROUNDING)


def _vehicle_checks(subject: Subject) -> Checks:
    """Check that the vehicle in the certificate is complete, and the installed one if one of its name is installed."""
    stated = subject.certificate["inputs"].get("vehicle")
    if stated is None:
        return
    fields = under("inputs.vehicle", stated)
    wrong = [name for name, value in subject.vehicle.to_parameters().items() if stated.get(name) != value]
    wrong += [name for name in stated if name not in subject.vehicle.to_parameters()]
    yield Check("inputs.vehicle", ", ".join(wrong[:1]) or "complete", "complete", not wrong, True, fields)
    name = stated["vehicle.name"]
    if name in vehicle_names():
        same_vehicle = load_vehicle(name).to_parameters() == stated
        value = "as installed" if same_vehicle else f"not the installed vehicle {name!r}"
        yield Check("inputs.vehicle.vehicle.name", value, "as installed", same_vehicle, required=True)


# --- polytopic model, eq. 10 to 12, eq. 45 ----------------------------------------------------------------------------


def notch_in_series(design: ControlDesign) -> Filter:
    """Return the notch filter (eq. 38) of ``design`` in continuous time (eq. 39)."""
    return Filter(*series(continuous(design.notch)))


def recomputed_model(subject: Subject) -> tuple[PolytopicModel, tuple[np.ndarray, np.ndarray]]:
    """Return the polytopic model recomputed from the vehicle, and the scales of its states (n) and inputs (2), SI.

    The inputs of the design say whether it is the vehicle alone (eq. 10 to 12) or with the notch filter (eq. 45).
    """
    from hsv.model.lpv.polytopic import polytopic_model

    inputs, extended = subject.certificate["inputs"]["model"], subject.stated("inputs.model.system") == "ECM"
    product, of_grid = inputs["tensor_product"], inputs["representation"] == "grid"
    states = sizes(product["state_scale"], STATE_NAMES)
    if extended:
        filters = sizes(product["filter_scale"], ("state_1", "state_2"))
        states = np.concatenate((states, *[filters] * len(subject.design.notch)))
    scales = states, sizes(product["input_scale"], INPUT_NAMES)
    of_axis = ("inputs.model.grid.{}_vertices" if of_grid else "inputs.model.tensor_product.{}_samples").format
    counts = subject.count(of_axis("altitude"), 100), subject.count(of_axis("velocity"), 100)
    notch = notch_in_series(subject.design) if extended else None
    tensor = None if of_grid else (product["tolerance"], product["functions"])
    return polytopic_model(subject.vehicle, notch, inputs["period"], counts, scales, tensor), scales


def model_checks(subject: Subject) -> Checks:
    """Compare vertices (eq. 12), singular values, weights and accuracy (eq. 11) with values from the vehicle."""
    design, inputs, (model, scales) = subject.design, subject.certificate["inputs"]["model"], recomputed_model(subject)
    shown = "{} from the vehicle".format
    yield parameter(subject, "model.a", design.polytope.A, model.polytope.A, shown("model.a"))
    yield parameter(subject, "model.b", design.polytope.B, model.polytope.B, shown("model.b"))
    found, expected = design.interpolation, model.interpolation
    yield Check("scheduling.interpolation", found, repr(expected), found == expected)
    given = design.altitude_samples, design.velocity_samples
    for axis, flown, sampled in zip(("altitude", "velocity"), given, model.samples, strict=True):
        yield parameter(subject, f"scheduling.{axis}.breakpoints", flown[0], sampled[0])
        yield parameter(subject, f"scheduling.{axis}.weights", flown[1], sampled[1])
    read = [field for field in leaves(inputs) if field != "tensor_product.tolerance"]
    check = equal(subject, "model.representation", inputs["representation"])
    yield replace(check, fields=(check.name, *under("inputs.model", read)))
    yield recomputed(subject, "model.vertices", [weights.shape[1] for _, weights in model.samples], "copied")
    shown_values = [values[:8] for values in model.singular_values]
    yield recomputed(subject, "model.singular_values", shown_values, "singular values")
    judged = design.polytope if inputs["system"] == "DM" else model.whole
    for name, value in model.accuracy(judged, scales).items():
        kind = {"points": "copied", "smallest_weight": "weights", "weight_sum_error": "sums"}.get(name, "accuracy")
        yield recomputed(subject, f"model.accuracy.{name}", value, kind)
        if name in ACCURACY:
            yield at_most(f"{name}, between the samples", value, ACCURACY[name])


# --- feedback gain F, eq. 24 ------------------------------------------------------------------------------------------


def feedback_checks(subject: Subject) -> Checks:
    """Check that e' N^-1 e decreases at every vertex under F = M N^-1 (eq. 24), and that A + B F is stable (eq. 22)."""
    design, F = subject.design, subject.design.feedback_gain
    A, B = design.polytope.A, design.polytope.B
    M, N = np.array(subject.stated("feedback.M")), np.array(subject.stated("feedback.N"))
    shown, fields = "feedback.gain = M N^-1", ("feedback.M", "feedback.N")
    yield parameter(subject, "feedback.gain", F, quotient(M, N), shown, fields=fields)
    yield symmetric("feedback.N", N)
    rigid = (A + B @ F)[:, :N_RIGID, :N_RIGID]
    # The smallest eigenvalue of [N, (A_c N)'; A_c N, N] with N scaled to the identity.
    residuals = 1.0 - image_norms(N, rigid)
    yield required(above("(24) smallest eigenvalue", residuals.min(), 0.0))
    yield recomputed(subject, "feedback.lmi_smallest_eigenvalues", residuals, "eigenvalues")
    yield recomputed(subject, "feedback.spectral_radii", radii(rigid), "spectral radii")
    whole = radii(A + B @ F).max()
    yield recomputed(subject, "feedback.spectral_radius_all_states", whole, "spectral radii")
    yield required(at_most("spectral radius of A + BF, all states", whole, 1.0 - 1e-6))


# --- nominal gains K, eq. 31 to 35 ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class NominalWeights:
    """Data of eq. 31 to 35: vertices, cost weights and input bounds of the nominal problem.

    ``A`` (r, 5, 5) and ``B`` (r, 5, 2) are the vertices on the rigid states, ``psi`` (5, 5) and ``sigma`` (2, 2) the
    weights of states and inputs, and ``bound`` (2) the largest |u_n|.
    """

    A: np.ndarray
    B: np.ndarray
    psi: np.ndarray
    sigma: np.ndarray
    bound: np.ndarray

    @classmethod
    def of(cls, subject: Subject) -> NominalWeights:
        """Return the nominal problem of a design, with weights that make a cost an integral over time, in s."""
        polytope, inputs = subject.design.polytope, subject.certificate["inputs"]["nominal"]
        scales = sizes(inputs["state_scale"], STATE_NAMES[:N_RIGID]), sizes(inputs["input_scale"], INPUT_NAMES)
        psi, sigma = (subject.design.period * np.diag(scale**-2.0) for scale in scales)
        adjustable = subject.certificate.get("adjustable")
        bound = np.array(adjustable["input_bound"]) if adjustable else sizes(inputs["input_bound"], INPUT_NAMES)
        return cls(polytope.A[:, :N_RIGID, :N_RIGID], polytope.B[:, :N_RIGID], psi, sigma, bound)

    def cost(self, K: np.ndarray, Q: np.ndarray) -> float:
        """Return the smallest gamma_n (eq. 32) that satisfies eq. 34 at every vertex, for K (2, 5) and Q (5, 5).

        By its Schur complement, eq. 34 reads gamma_n (Q^-1 - A_c' Q^-1 A_c) >= psi + K' sigma K with A_c = A + B K.

        Raises:
            DesignError: x' Q^-1 x does not decrease at a vertex.
        """
        L = np.linalg.cholesky(Q)
        M = np.linalg.solve(L, (self.A + self.B @ K) @ L)
        decrease = np.eye(len(Q)) - np.swapaxes(M, 1, 2) @ M
        if not (least := np.linalg.eigvalsh(decrease).min()) > 0.0:
            raise DesignError(f"decrease of the cost = {least:.3g}, expected above zero")
        stage = L.T @ (self.psi + K.T @ self.sigma @ K) @ L
        return float(np.linalg.eigvals(np.linalg.solve(decrease, stage)).real.max())

    def decrease(self, K: np.ndarray, Q: np.ndarray, gamma: float) -> np.ndarray:
        """Return the smallest eigenvalue (r) of the matrix of eq. 34 at each vertex, diagonal blocks scaled to 1."""
        L = np.linalg.cholesky(Q)
        M = np.linalg.solve(L, (self.A + self.B @ K) @ L)
        stage = np.vstack((np.sqrt(self.psi) @ L, np.sqrt(self.sigma) @ K @ L)) / np.sqrt(gamma)
        stacked = np.concatenate((M, np.broadcast_to(stage, (len(M), *stage.shape))), axis=1)
        return np.asarray(1.0 - np.linalg.norm(stacked, 2, axis=(1, 2)))


def nominal_checks(subject: Subject) -> Checks:
    """Check every gain K = Y Q^-1 with its ellipsoid (eq. 31 to 35), and that A + B K is stable (eq. 20).

    Two further checks are not in the paper. Each ellipsoid lies in the one before, so that gains may be switched. In an
    interpolated family, the level in each ellipsoid also decreases under the gain of the next one inside.
    """
    design, inputs = subject.design, subject.certificate["inputs"]["nominal"]
    weights, stated = NominalWeights.of(subject), subject.certificate["nominal"]
    scales = sizes(inputs["state_scale"], STATE_NAMES[:N_RIGID]), sizes(inputs["input_scale"], INPUT_NAMES)
    for name, flown, scale in (
        ("state_scale", design.nominal_state_scale, scales[0]),
        ("input_scale", design.nominal_input_scale, scales[1]),
        ("input_bound", design.nominal_input_bound, weights.bound),
    ):
        relaxed = name == "input_bound" and "adjustable" in subject.certificate
        fields = ("adjustable.input_bound",) if relaxed else under(f"inputs.nominal.{name}", inputs[name])
        yield parameter(subject, f"nominal.{name}", flown, scale, fields=fields)
    counts = [len(design.nominal_gains), len(design.nominal_ellipsoids), len(stated)]
    yield same("number of nominal gains, ellipsoids, statements", counts, [len(inputs["scales"])] * 3, "copied")
    start = step(subject)
    for i, (one, K, P) in enumerate(zip(stated, design.nominal_gains, design.nominal_ellipsoids, strict=True)):
        Q, field = np.array(one["Q"]), f"nominal.{i}"
        shown, fields = f"nominal.gains[{i}] = Y Q^-1", (f"{field}.Y", f"{field}.Q")
        yield parameter(subject, "nominal.gains", K, quotient(np.array(one["Y"]), Q), shown, fields=fields)
        yield parameter(subject, "nominal.ellipsoids", P, inverse(Q), f"nominal.ellipsoids[{i}] = Q^-1", i)
        yield from _gain_checks(subject, field, weights, K[:, :N_RIGID], inputs["scales"][i] * start)
        check = recomputed(subject, f"{field}.scale", inputs["scales"][i], "copied")
        points = (f"inputs.nominal.{at}.{axis}" for at in ("start", "target") for axis in ("altitude", "velocity"))
        yield replace(check, fields=(f"{field}.scale", "inputs.nominal.scales", *points))
        radius = radii(design.polytope.A + design.polytope.B @ K).max()
        yield recomputed(subject, f"{field}.spectral_radius_all_states", radius, "spectral radii")
        yield required(at_most(f"spectral radius of A + BK, gain {i}", radius, 1.0 - 1e-6))
    yield equal(subject, "nominal.0.nesting_residual", None)
    for i, (outer, inner) in enumerate(pairwise([np.array(one["Q"]) for one in stated]), start=1):
        # In coordinates in which the outer ellipsoid is the unit ball.
        room = 1.0 - float(image_norms(outer, np.zeros_like(outer), np.linalg.cholesky(inner))) ** 2
        yield recomputed(subject, f"nominal.{i}.nesting_residual", room, "eigenvalues")
        yield above(f"ellipsoid {i} inside the one before", room, 0.0)
        if design.interpolated:
            K = design.nominal_gains[i][:, :N_RIGID]
            between = 1.0 - image_norms(outer, weights.A + weights.B @ K) ** 2
            yield required(above(f"decrease in ellipsoid {i - 1} under gain {i}", between.min(), 0.0))
            yield recomputed(subject, f"nominal.{i}.between_smallest_eigenvalues", between, "eigenvalues")
    interpolated = bool(inputs.get("interpolated"))
    value, ok = str(design.interpolated), design.interpolated == interpolated
    check = Check("nominal.interpolated", value, str(interpolated), ok, required=True)
    yield replace(check, fields=("inputs.nominal.interpolated",))


def step(subject: Subject) -> np.ndarray:
    """Return x_n(0) (5) of the jump for which the gains are designed: trim at its start minus trim at its target."""
    inputs, vehicle = subject.certificate["inputs"]["nominal"], subject.vehicle.decoupled
    start, target = (trim(vehicle, inputs[at]["altitude"], inputs[at]["velocity"]).state for at in ("start", "target"))
    return np.asarray((start - target)[:N_RIGID])


def _gain_checks(subject: Subject, field: str, weights: NominalWeights, K: np.ndarray, state: np.ndarray) -> Checks:
    """Check the gain ``K`` (2, 5) stated under ``field`` (eq. 31 to 35) for the design state x_n(0) = ``state`` (5)."""
    Q = np.array(subject.stated(f"{field}.Q"))
    yield symmetric(f"{field}.Q", Q)
    try:
        gamma = weights.cost(K, Q)
    except DesignError as error:
        raise DesignError(f"{field}: {error}") from error
    yield recomputed(subject, f"{field}.certified_gamma", gamma, "certified costs")
    decrease = weights.decrease(K, Q, subject.stated(f"{field}.certified_gamma"))
    yield above(f"{field}: (34) smallest eigenvalue", decrease.min(), -ROUNDING)
    yield recomputed(subject, f"{field}.lmi_smallest_eigenvalues", decrease, "eigenvalues")
    # Eq. 33 (eq. 50 for K'): x_n(0) lies in the ellipsoid.
    room = 1.0 - float(ellipsoid_levels(Q, state))
    yield above(f"{field}: (33) room of the design state", room, -ROUNDING)
    yield recomputed(subject, f"{field}.state_residual", room, "eigenvalues")
    # Eq. 35 (eq. 52 for K'): the largest |K x| over the ellipsoid stays within the bounds.
    inputs = 1.0 - np.sum((K @ Q) * K, axis=1) / weights.bound**2
    yield above(f"{field}: (35) room of the inputs", inputs.min(), 0.0)
    yield recomputed(subject, f"{field}.input_residuals", inputs, "eigenvalues")
    yield recomputed(subject, f"{field}.spectral_radii", radii(weights.A + weights.B @ K), "spectral radii")


def symmetric(name: str, Q: np.ndarray) -> Check:
    """Return the required check that ``Q`` (..., n, n) is symmetric; other checks may read one triangle only."""
    asymmetry = float(np.abs(Q - np.swapaxes(Q, -1, -2)).max(initial=0.0))
    return required(at_most(f"{name}, difference from its transpose", asymmetry, 0.0))


# --- error system, eq. 22, eq. 23 -------------------------------------------------------------------------------------


class ErrorSystem(NamedTuple):
    """The error system e(k+1) = A_i e(k) + G_i d(k) in closed loop with the feedback F e + F_d d.

    ``A`` (r, n, n) and ``G`` (r, n, 7) at r vertices, ``F`` (2, n), ``F_d`` (2, 7). The error e consists of the rigid
    states, the notch filter and the actuators of the design; ``names`` (n) lists its components.
    """

    A: np.ndarray
    G: np.ndarray
    F: np.ndarray
    F_d: np.ndarray
    names: tuple[str, ...]


def error_system(
    design: ControlDesign,
    vehicle: Vehicle,
    tau: np.ndarray,
    effectiveness: float = 1.0,
    number: Callable[[Any], np.ndarray] = np.asarray,
) -> ErrorSystem:
    """Return the error system (eq. 22, 23) for the feedback tau F, with notch filter and actuators in the state.

    The feedback uses the filtered pitch rate q_f = C_s s + D_s q, with s the state of the filter. Its output u drives
    the actuators, with state a, which act on the vehicle by their mean position over a period, C_a a + D_a u.

    Args:
        design: Design with vertices, F, notch filter and actuators.
        vehicle: Vehicle of the design.
        tau: (5) factors of the feedback of the rigid states.
        effectiveness: Effectiveness of the elevator, from 0 to 1.
        number: Conversion of the given numbers to an array; :func:`hsv.certificate.exact.rational` makes all sums and
            products exact.
    """
    period, polytope, actuators = design.period, design.polytope, design.actuator_sets
    A_s, B_s, C_s, D_s = map(number, series(discretise(design.notch, period)))
    sampled = sampled_actuators(actuators, period)
    A_a, B_a, C_a, D_a = map(number, (sampled.A, sampled.B, sampled.C, sampled.D if actuators else np.eye(N_INPUTS)))
    r, x, s, n = len(polytope.A), N_RIGID, len(A_s), len(A_a)
    filters, positions = slice(x, x + s), slice(x + s, x + s + n)
    zeros = partial(np.zeros, dtype=A_s.dtype)
    B_x = number(polytope.B[:, :x]) * number([1.0, effectiveness])
    A, B = zeros((r, x + s + n, x + s + n)), zeros((r, x + s + n, N_INPUTS))
    A[:, :x, :x], A[:, :x, positions], A[:, positions, positions] = number(polytope.A[:, :x, :x]), B_x @ C_a, A_a
    A[:, filters, PITCH_RATE], A[:, filters, filters] = B_s, A_s
    B[:, :x], B[:, positions] = B_x @ D_a, B_a
    rigid = number(design.feedback_gain[:, :x]) * number(tau)
    F = zeros((N_INPUTS, x + s + n))
    F[:, :x], F[:, filters] = rigid, np.outer(rigid[:, PITCH_RATE], C_s)
    F[:, PITCH_RATE] *= D_s
    G, F_d = zeros((r, x + s + n, len(CHANNELS))), zeros((N_INPUTS, len(CHANNELS)))
    G[:, :x, :3] = number(acceleration_channels(vehicle, period))
    G[:, :, 3], G[:, :, 4] = B[:, :, 1], B @ rigid[:, PITCH_RATE]  # lost elevator; notch(q_n) - q_n through F
    G[:, 0, 5] = G[:, 3, 6] = number(1.0)
    F_d[:, 4] = rigid[:, PITCH_RATE]
    names = STATE_NAMES[:x] + tuple(f"filter_{i + 1}" for i in range(s)) + actuator_names(actuators)
    return ErrorSystem(A + B @ F, G, F, F_d, names)


def extreme_factors(design: ControlDesign) -> list[np.ndarray]:
    """Return the extreme factors tau (5 each): ``tau_minimum`` and all ones; the latter alone if they are equal.

    A set that is invariant under both extremes is invariant under any variation of tau on the line between them.
    """
    one = np.ones(N_RIGID)
    return [one] if np.array_equal(design.tau_minimum, one) else [design.tau_minimum, one]


# --- invariant set, eq. 25 to 28, and tightened bounds, eq. 30 --------------------------------------------------------


class Tube:
    """A tube stated under ``field`` of a certificate, with the closed loops of the design.

    Its set is the ellipsoid (e - c)' Q^-1 (e - c) <= 1 with ``c`` (n) and ``Q`` (n, n). The disturbance set W is a box
    with mid-point ``middle`` (7) and half-widths ``half`` (7). The r closed loops are those of all vertices, at each
    of the extreme :func:`extreme_factors` tau; the F of the first, the smallest, is that of ``rows`` and of the bounds.
    """

    def __init__(
        self,
        subject: Subject,
        design: ControlDesign,
        field: str,
        number: Callable[[Any], np.ndarray] = np.asarray,
    ) -> None:
        """Read the tube under ``field`` of the certificate; compute the error systems at the extreme factors tau.

        ``number`` converts all numbers, see :func:`error_system`.
        """
        self.field, self.design = field, design
        systems = [error_system(design, subject.vehicle, tau, number=number) for tau in extreme_factors(design)]
        self.system = systems[0]
        self.A, self.G = (np.concatenate([getattr(s, name) for s in systems]) for name in ("A", "G"))
        stated = subject.stated(f"{field}.invariant_set")
        self.c, self.Q, self.l = (number(stated[name]) for name in ("centre", "Q", "multipliers"))
        self.lam = float(stated["contraction"])
        channels = subject.stated(f"{field}.disturbance.channels")
        self.lower, self.upper = (number([channels[c.name][side] for c in CHANNELS]) for side in ("lower", "upper"))
        self.middle, self.half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        self.star = None
        if "star_norms" in stated:
            self.star = StarNorms(*(number(stated["star_norms"][name]) for name in ("Q", "contraction")))
        self.rows = np.vstack((number(np.eye(N_RIGID, len(self.c))), self.system.F))
        self.rated = number(stated["rated"]["half_range"]) if "rated" in stated else None

    @property
    def columns(self) -> np.ndarray:
        """Columns (r, n, 8) that act on e - c: the 7 channels of W times their half-widths, and the drift of c.

        The drift is the change of e in one step from e = c, with the disturbances at the mid-point of W.
        """
        drift = self.A @ self.c + self.G @ self.middle - self.c
        return np.concatenate((self.G * self.half, drift[:, :, None]), axis=2)

    def start_parts(self) -> dict[int, np.ndarray]:
        """Return the parts (n) into which the start e = 0 is split, by the index of each acting channel.

        The start e - c = -c (eq. 25) is their sum. A part is minus the steady response of the mean closed loop to the
        mid-point of the channel, but the remainder for the last. The paper has no such split.
        """
        acting, mean = np.flatnonzero((self.columns != 0).any(axis=(0, 1))).tolist(), self.A.mean(axis=0)
        steady = np.linalg.solve(mean - np.eye(len(mean)), self.G.mean(axis=0) * self.middle).T
        parts = {j: steady[j] for j in acting[:-1]}
        return parts | {acting[-1]: -self.c - np.sum(list(parts.values()), axis=0)}

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths (n) of the set (eq. 28); those of the rigid states are narrowed by star norms, if stated."""
        return self._narrowed(np.sqrt(np.diag(self.Q)), slice(N_RIGID))

    @property
    def feedback(self) -> np.ndarray:
        """Half-ranges (2) of F e over the set (F Z, eq. 30) at the smallest tau; narrowed by star norms, if stated."""
        F = self.system.F
        return self._narrowed(np.sqrt(np.sum((F @ self.Q) * F, axis=1)), slice(N_RIGID, None))

    @property
    def certified(self) -> np.ndarray:
        """Certified half-ranges (7) of the outputs :attr:`rows`; at limited rates, if stated."""
        bounds = np.concatenate((self.half_width[:N_RIGID], self.feedback))
        return bounds if self.rated is None else np.minimum(bounds, self.rated)

    def _narrowed(self, bounds: np.ndarray, rows: slice) -> np.ndarray:
        """Return ``bounds``; the first of them are limited to the star norms of the output ``rows``, if stated."""
        if self.star is None:
            return bounds
        # An output is bounded by the sum, over all channels, of its half-range in the ellipsoid of the channel.
        star = np.sqrt(np.einsum("ki,kjil,kl->kj", self.rows, self.star.Q, self.rows)).sum(axis=1)[rows]
        return np.append(np.minimum(bounds[: len(star)], star), bounds[len(star) :])

    def residuals(self) -> np.ndarray:
        """Return the smallest eigenvalues (r) of Q - A Q A' / lam - sum_j g_j g_j' / l_j, with Q scaled to 1.

        There is one for each closed loop, with its A, its :attr:`columns` g_j and multipliers l_j, and the contraction
        lam. If all are positive, the set is invariant (eq. 26, S-procedure): from v = e - c in the set and with
        |d_j| <= 1, the level after a step is at most lam v' Q^-1 v + sum_j l_j d_j^2 <= lam + (1 - lam).

        Raises:
            DesignError: A multiplier is not positive, or their sum exceeds 1 - lam.
        """
        if self.l.min() <= 0.0 or self.l.sum(axis=1).max() > (1.0 - self.lam) * (1.0 + 1e-12):
            raise DesignError("multipliers: expected all above zero and sums of at most 1 - contraction")
        scaled = self.columns / np.sqrt(self.l)[:, None, :]
        return 1.0 - image_norms(self.Q, self.A / np.sqrt(self.lam), scaled) ** 2

    def tightened(self, lag: Sequence[Sequence[float]] = ((0.0, 0.0), (0.0, 0.0))) -> np.ndarray:
        """Return the lower and upper bounds (2 each) of u_n + u_r: U minus the range of the feedback (eq. 30).

        The feedback is that at the smallest tau, and at limited rates if the certificate states them. Eq. 53 prints a
        plus instead. ``lag`` is the minimum and maximum (2 each) of the feedback that arises because the actuators lag
        behind the plan.
        """
        middle = self.system.F @ self.c + self.system.F_d @ self.middle
        half = self.certified[N_RIGID:] + np.abs(self.system.F_d) @ self.half
        lower, upper = self.design.input_minimum - middle + half, self.design.input_maximum - middle - half
        return np.stack((lower - lag[0], upper - lag[1]))


class StarNorms(NamedTuple):
    """Star norms: an ellipsoid ``Q`` (7, 8, n, n) and its ``contraction`` (7, 8) for each output row and channel.

    The 7 rows are those of :attr:`Tube.rows`: rigid states, then feedback. The 8 channels are :attr:`Tube.columns`.
    """

    Q: np.ndarray
    contraction: np.ndarray

    def residuals(self, tube: Tube) -> np.ndarray:
        """Return a residual (7, a) for each output row and acting channel; if positive, their ellipsoid is invariant.

        A channel acts if its column is not zero everywhere. The ellipsoid v' Q^-1 v <= 1 is invariant under
        v(k+1) = A_i v + g_i d with |d| <= 1 if Q - A_i Q A_i' / lam - g_i g_i' / (1 - lam) >= 0 (Abedor, Nagpal and
        Poolla 1996), with contraction lam. A residual is the smallest eigenvalue of this matrix over all closed loops
        i of the tube, with Q scaled to the identity.

        Raises:
            DesignError: A contraction is not between 0 and 1.
        """
        if not (self.contraction.min() > 0.0 and self.contraction.max() < 1.0):
            raise DesignError("star_norms.contraction: expected between 0 and 1")
        acting, columns = np.flatnonzero(tube.columns.any(axis=(0, 1))), tube.columns
        return np.array(
            [
                [
                    1.0
                    - image_norms(Q[j], tube.A / np.sqrt(lam[j]), columns[:, :, j, None] / np.sqrt(1.0 - lam[j])).max()
                    ** 2
                    for j in acting
                ]
                for Q, lam in zip(self.Q, self.contraction, strict=True)
            ]
        )

    def start(self, tube: Tube) -> float:
        """Return the largest level of the parts of the start e = 0 in their ellipsoids; at most 1 inside."""
        return max(float(ellipsoid_levels(Q[j], part)) for Q in self.Q for j, part in tube.start_parts().items())


def set_checks(subject: Subject) -> Checks:
    """Check the tube used in flight: invariance, half-widths, W, star norms, tightened bounds and bounds of plans."""
    design = subject.design
    tube, inputs = Tube(subject, design, "tube"), subject.certificate["inputs"]["disturbance"]
    yield required(at_least("inputs.disturbance.inflation", inputs["inflation"], 1.0))
    yield required(at_most("inputs.disturbance.share", inputs["share"], 1.0))
    if inputs["share"] == 1.0:
        yield required(at_most("largest ratio to W", subject.stated("tube.flights.worst_ratio"), 1.0))
    yield required(at_most("largest level", subject.stated("tube.flights.worst_level"), 1.0))
    yield Check("tube parameters", str(design.tube is not None), "True", design.tube is not None)
    seen = len(tube.c) - sum(name.startswith(INPUT_NAMES) for name in tube.system.names)
    if design.tube is not None:
        shape = inverse(tube.Q[:seen, :seen])
        yield required(
            parameter(subject, "tube.centre", design.tube.centre, tube.c[:seen], fields=("tube.invariant_set.centre",))
        )
        yield required(parameter(subject, "tube.shape", design.tube.shape, shape, "tube.shape = Q^-1"))
        half_width = tube.half_width[:seen]
        yield required(
            parameter(subject, "tube.half_width", design.tube.half_width, half_width, "tube.half_width from Q")
        )
    rates = declared_rates(subject)
    fields = tuple(f"inputs.invariant_set.rates.{axis}" for axis in ("altitude", "velocity")) if rates else ()
    flown: Any = [] if design.tube is None else design.tube.rates
    yield required(parameter(subject, "tube.rates", flown, rates, fields=fields))
    stated = tube.rated is not None
    yield required(Check("bounds at limited rates", str(stated), str(bool(rates)), stated == bool(rates)))
    yield from _tube_checks(subject, tube)
    method = "ellipsoid" if tube.star is None else "star_norms"
    yield required(equal(subject, "inputs.invariant_set.method", method))
    if tube.star:
        yield from _star_checks(subject, tube)
    tightening, bounds = subject.certificate["tube"]["tightening"], tube.tightened(lag_feedback(subject))
    plan = tightening["plan"]
    lowest, highest = np.array(plan["lowest"]), np.array(plan["highest"])
    room = lowest[:2] - bounds[0], bounds[1] - highest[:2]
    yield recomputed(subject, "tube.tightening.plan.margin_to_lower", room[0], "room of plans")
    yield recomputed(subject, "tube.tightening.plan.margin_to_upper", room[1], "room of plans")
    yield above("room of the nominal plan", float(np.min(room)), 0.0)
    yield Check("nominal plan bounds", str(design.plan_bounds is not None), "True", design.plan_bounds is not None)
    if design.plan_bounds is not None:
        # Not in the paper: plans in flight also keep to the range of the certified ones, shifted down.
        shift = PLAN_SHIFT * (highest - lowest) * np.array([1.0, 1.0, 0.0])
        expected = bounds[0], bounds[1], lowest - shift, highest - shift
        names = "input_minimum", "input_maximum", "region_minimum", "region_maximum"
        of_plans = under("tube.tightening.plan", ("lowest", "highest"))
        for name, value in zip(names, expected, strict=True):
            shown, flown = f"nominal.{name} from the tightened bounds and plans", getattr(design.plan_bounds, name)
            yield parameter(subject, f"nominal.{name}", flown, value, shown, fields=of_plans)


def lag_feedback(subject: Subject) -> Sequence[Sequence[float]]:
    """Return the smallest and largest feedback, shape (2,) each, due to the actuators' lag; zeros if none is stated."""
    lag = subject.certificate["tube"]["tightening"].get("lag_feedback")
    return (lag["lower"], lag["upper"]) if lag else ((0.0, 0.0), (0.0, 0.0))


def _tube_checks(subject: Subject, tube: Tube) -> Checks:
    """Check what the field of ``tube`` states: set (eq. 25 to 28), W (eq. 19) and tightened bounds (eq. 30, 53)."""
    field = tube.field
    inside = f"{field}.invariant_set"
    yield equal(subject, f"{inside}.kind", "ellipsoid")
    yield equal(subject, f"{inside}.states", list(tube.system.names))
    yield symmetric(f"{inside}.Q", tube.Q)
    yield recomputed(subject, f"{inside}.half_width", tube.half_width, "half-widths")
    yield recomputed(subject, f"{inside}.feedback_half_range", tube.feedback, "half-widths")
    residuals = tube.residuals()
    fields = tuple(f"{inside}.{name}" for name in ("Q", "centre", "contraction", "multipliers"))
    shown = f"{field}: invariance, smallest eigenvalue over the vertices"
    yield replace(required(above(shown, residuals.min(), 0.0)), fields=fields)
    yield recomputed(subject, f"{inside}.certificate.lmi_smallest_eigenvalues", residuals, "eigenvalues")
    # A flight starts at e = 0, which lies in Z (eq. 25). Unlike the paper's, Z has a centre c, as W is not symmetric.
    at_start = float(ellipsoid_levels(tube.Q, -tube.c))
    yield required(at_most(f"{field}: level of e = 0", at_start, 1.0))
    yield recomputed(subject, f"{inside}.certificate.level_of_zero_error", at_start, "eigenvalues")
    yield from _measured_checks(subject, tube)
    for channel in CHANNELS:
        yield equal(subject, f"{field}.disturbance.channels.{channel.name}.unit", channel.unit)
    lag = lag_feedback(subject) if field == "tube" else ((0.0, 0.0), (0.0, 0.0))
    for side, bound in zip(("lower", "upper"), tube.tightened(lag), strict=True):
        check = recomputed(subject, f"{field}.tightening.{side}", bound, "tightened bounds")
        yield replace(check, fields=(*check.fields, f"{field}.tightening.lag_feedback.{side}"))


def _measured_checks(subject: Subject, tube: Tube) -> Checks:
    """Check that W is the measured disturbances (eq. 19) times inflation and share, both not in the paper.

    The two preliminary sets of an adjustable design state W alone: its flights had the gains before the last step.
    """
    field, inputs = f"{tube.field}.disturbance", subject.certificate["inputs"]["disturbance"]
    for side, bounds, sign in (("lower", tube.lower, -1.0), ("upper", tube.upper, 1.0)):
        fields = under(f"{field}.channels", (f"{channel.name}.{side}" for channel in CHANNELS))
        if tube.field != "tube":
            yield replace(at_least(f"{field}, {side}", float((sign * bounds).min()), 0.0), fields=fields)
            continue
        outward = inflated_bounds(sign * np.array(subject.stated(f"{field}.measured.{side}")), inputs["inflation"])
        check = same(f"{field}, {side}", bounds, sign * inputs["share"] * outward, "disturbance bounds")
        yield replace(check, fields=(*fields, *under("inputs.disturbance", ("inflation", "share"))))


def inflated_bounds(bounds: np.ndarray, inflation: float) -> np.ndarray:
    """Return ``bounds`` times ``inflation``, rounded up to six significant digits; negative bounds become zero."""
    bounds = inflation * np.maximum(bounds, 0.0)
    quantum = 10.0 ** (np.floor(np.log10(np.where(bounds > 0.0, bounds, 1.0))) - 5.0)
    return np.asarray(quantum * np.ceil(bounds / quantum * (1.0 - 1e-12)))


def _star_checks(subject: Subject, tube: Tube) -> Checks:
    """Check that the ellipsoids of the star norms are symmetric, invariant, and contain the start e = 0."""
    star, inside = tube.star, "tube.invariant_set"
    assert star is not None
    shape = (len(tube.rows), len(CHANNELS) + 1)
    yield required(same("star norms, shape", star.Q.shape, (*shape, *tube.Q.shape), "copied"))
    yield symmetric("star norms", star.Q)
    least, start = star.residuals(tube).min(), star.start(tube)
    fields = f"{inside}.star_norms.Q", f"{inside}.star_norms.contraction"
    yield replace(required(above("invariance of the star norms, smallest eigenvalue", least, 0.0)), fields=fields)
    yield required(at_most("level of e = 0 in the star norms", start, 1.0))
    yield recomputed(subject, f"{inside}.certificate.star_norms.smallest_eigenvalue", least, "eigenvalues")
    yield recomputed(subject, f"{inside}.certificate.star_norms.level_of_zero_error", start, "eigenvalues")


def step_checks(subject: Subject) -> Checks:
    """Recompute what disturbances in W add to the rigid states in a step, which the status in flight watches.

    The plan's filtered pitch rate is known in flight, so that its channel is left out.
    """
    tube, field = Tube(subject, subject.design, "tube"), "tube.disturbance.step"
    kept = [j for j, channel in enumerate(CHANNELS) if channel.name != "filtered_nominal_rate"]
    ends = np.stack([(tube.G * side)[:, :N_RIGID, kept] for side in (tube.lower, tube.upper)])
    lower, upper = ends.min(axis=0).sum(axis=2), ends.max(axis=0).sum(axis=2)
    yield recomputed(subject, f"{field}.lower", lower.min(axis=0), "disturbance bounds")
    yield recomputed(subject, f"{field}.upper", upper.max(axis=0), "disturbance bounds")


def rated_checks(subject: Subject) -> Checks:
    """Recompute the bounds for flights at limited rates of altitude and velocity, where a design has them."""
    tube, inside = Tube(subject, subject.design, "tube"), "tube.invariant_set"
    if tube.rated is None:
        return
    rates, field = declared_rates(subject), f"{inside}.rated.horizon"
    yield recomputed(subject, f"{inside}.rated.rates", rates, "copied")
    horizons = [subject.count(f"{field}.{k}", LONGEST) for k in range(len(tube.rows))]
    check = recomputed(subject, f"{inside}.rated.half_range", bounds_at(tube, rates, horizons), "half-widths")
    yield required(replace(check, fields=(*check.fields, field)))


def bounds_at(tube: Tube, rates: Sequence[float], horizons: Sequence[int]) -> np.ndarray:
    """Return bounds (7) of the outputs for flights at limited ``rates`` (m/s, m/s^2), see :func:`rated_bounds`."""
    stacks = [[tube.Q[None]] for _ in tube.rows]
    if tube.star:
        acting = tube.columns.any(axis=(0, 1))
        stacks = [[*stack, Q[acting]] for stack, Q in zip(stacks, tube.star.Q, strict=True)]
    loops, changes = np.concatenate((tube.A, tube.columns), axis=2), np.array(rates) * tube.design.period
    return rated_bounds(tube.design.polytope, loops, tube.c, tube.rows, stacks, changes, horizons)[0]


def declared_rates(subject: Subject) -> list[float]:
    """Return the largest rates of altitude (m/s) and velocity (m/s^2) in the inputs of a design; empty: any rates."""
    rates = subject.certificate["inputs"]["invariant_set"].get("rates")
    return [] if rates is None else [rates["altitude"], rates["velocity"]]


def counter_example_checks(subject: Subject) -> Checks:
    """Recompute the errors that counter-examples reach (eq. 22); no half-width (eq. 28) may be smaller."""
    inside = "tube.invariant_set"
    tube, stated = Tube(subject, subject.design, "tube"), subject.stated(f"{inside}.counter_examples")
    outputs = zip(tube.rows, stated["sequences"], strict=True)
    driven = np.array([reach(tube.A, tube.G * tube.half, row, sequence) for row, sequence in outputs])
    check = recomputed(subject, f"{inside}.counter_examples.half_range", driven, "half-widths")
    yield replace(check, fields=(check.name, f"{inside}.counter_examples.sequences"))
    certified = np.concatenate((tube.half_width[:N_RIGID], tube.feedback))
    yield required(at_most("counter-examples, largest share of a half-width", (driven / certified).max(), 1.0))


def reach(A: np.ndarray, columns: np.ndarray, row: np.ndarray, sequence: Sequence[tuple[int, int]]) -> float:
    """Return the largest output ``row`` (n) of v+ = A_i v + g_i d with |d_j| <= 1 after a ``sequence`` from v = 0.

    It is the sum of |l g_i| over all steps, with l the response of the output to the v after the step. ``columns`` (r,
    n, d) are the g_i; the sequence has pairs of vertex i and number of steps, first step first.

    Raises:
        DesignError: A pair is none, or the steps are too many.
    """
    reached = 0.0
    if not all(vertex >= 0 < steps for vertex, steps in sequence) or sum(steps for _, steps in sequence) > _LONGEST:
        raise DesignError(f"counter-examples: expected a vertex and its steps, in turn, at most {_LONGEST} steps")
    for vertex, steps in reversed(sequence):
        for _ in range(steps):
            reached += float(np.abs(row @ columns[vertex]).sum())
            row = row @ A[vertex]
    return reached


# --- adjustable factor, eq. 47 to 54 ----------------------------------------------------------------------------------


def factor_checks(subject: Subject) -> Checks:
    """Check that tau (eq. 48) may change in flight, or that it is fixed at 1 if the design is not adjustable.

    It may change if both extreme factors share one Lyapunov function, with and without the fault, and the plan also
    fits at tau = 1.
    """
    design, stated = subject.design, subject.certificate.get("adjustable")
    filtered = stated is not None
    yield required(Check("nominal.filtered", str(design.filtered), str(filtered), design.filtered == filtered))
    least = np.ones(N_RIGID) if stated is None else stated["tau_minimum"]
    fields = () if stated is None else ("adjustable.tau_minimum",)
    yield required(parameter(subject, "feedback.tau_minimum", design.tau_minimum, least, fields=fields))
    if stated is None:
        return
    # e' N^-1 e of eq. 24 decreases at both extreme factors, with full and with reduced elevator effectiveness.
    shares = 1.0, subject.stated("inputs.disturbance.elevator_effectiveness")
    corners = product(extreme_factors(design), shares)
    loops = [error_system(design, subject.vehicle, tau, share).A for tau, share in corners]
    N = np.array(stated["lyapunov"]["N"])
    yield symmetric("adjustable.lyapunov.N", N)
    residuals = 1.0 - image_norms(N, np.concatenate(loops))
    fields = ("adjustable.lyapunov.N",)
    yield replace(required(above("common Lyapunov function, smallest eigenvalue", residuals.min(), 0.0)), fields=fields)
    yield recomputed(subject, "adjustable.lyapunov.lmi_smallest_eigenvalues", residuals, "eigenvalues")
    # At tau = 1, too, the plan keeps within the tightened bounds of eq. 30.
    bounds = Tube(subject, replace(design, tau_minimum=np.ones(N_RIGID)), "tube").tightened()
    plan = subject.stated("tube.tightening.plan")
    room = np.minimum(plan["lowest"][:2] - bounds[0], bounds[1] - plan["highest"][:2])
    yield recomputed(subject, "adjustable.room_at_one", room, "room of plans")
    yield required(above("least room of the nominal plan at tau = 1", float(room.min()), 0.0))


def adjustable_checks(subject: Subject) -> Checks:
    """Check an adjustable design: tau (eq. 48), Z, Z' (eq. 47), relaxed bounds and K' (eq. 49 to 52), and poles."""
    design, stated = subject.design, subject.certificate.get("adjustable")
    if stated is None:
        return
    tau = np.array(subject.stated("inputs.adjustable.tau"))
    tau = np.full(N_RIGID, tau[0]) if len(tau) == 1 else tau
    yield recomputed(subject, "adjustable.tau", tau, "copied")
    yield recomputed(subject, "adjustable.share", tau.max(), "copied")
    yield parameter(subject, "feedback.tau", design.tau, tau, fields=("inputs.adjustable.tau",))
    one = np.ones(N_RIGID)
    complete = Tube(subject, replace(design, tau=one, tau_minimum=one), "adjustable.complete")
    incomplete = Tube(subject, design, "adjustable.incomplete")
    yield from _tube_checks(subject, complete)
    yield from _tube_checks(subject, incomplete)  # Z' and W' of eq. 47, in the form of eq. 25 to 28 and eq. 19
    # The paper states Z' = tau Z after eq. 48; the certificate keeps it for comparison with the computed Z'.
    scaled = np.append(tau, np.full(len(complete.c) - N_RIGID, tau[-1])) * complete.half_width
    yield recomputed(subject, "adjustable.scaled_half_width", scaled, "half-widths")
    # Not in the paper: the bound of eq. 52 grows by the ratio of the rooms at the target trim, eq. 53 over eq. 30.
    target = subject.stated("inputs.nominal.target")
    at_target = trim(subject.vehicle.decoupled, target["altitude"], target["velocity"]).input
    rooms = [np.minimum(at_target - t[0], t[1] - at_target) for t in (complete.tightened(), incomplete.tightened())]
    bound = sizes(subject.stated("inputs.nominal.input_bound"), INPUT_NAMES)
    relaxed = np.round(bound * rooms[1] / rooms[0], 6)
    check = recomputed(subject, "adjustable.input_bound", relaxed, "relaxed bounds")
    names = under("inputs.nominal.input_bound", INPUT_NAMES)
    yield replace(check, fields=("adjustable.input_bound", *names))
    single, weights = "adjustable.single_gain", NominalWeights.of(subject)
    Q = np.array(subject.stated(f"{single}.Q"))
    K = quotient(np.array(subject.stated(f"{single}.Y")), Q)[:, :N_RIGID]
    for check in _gain_checks(subject, single, weights, K, step(subject)):
        yield replace(check, fields=(*check.fields, f"{single}.Q", f"{single}.Y"))
    yield equal(subject, f"{single}.nesting_residual", None)
    yield from _full_state_checks(subject)


def _full_state_checks(subject: Subject) -> Checks:
    """Check the poles of the coupled vehicle (eq. 42) under the structured F and the full-state F' (eq. 24, eq. 45).

    F acts on the rigid states, F' also on the states of the notch filter. Also recomputed, for F': the spectral radii
    at the vertices and the elevator's gain on the true pitch rate. Only the poles under F must be stable.
    """
    design, field, notch = subject.design, "adjustable.full_state", notch_in_series(subject.design)
    gain, whole = np.array(subject.stated(f"{field}.gain")), recomputed_model(subject)[0].whole
    kept = [*range(N_RIGID), *range(N_STATES, N_STATES + len(notch.B))]
    loops = whole.A[:, kept][:, :, kept] + whole.B[:, kept] @ gain
    yield recomputed(subject, f"{field}.spectral_radii", radii(loops), "spectral radii")
    # Not in the paper: the gain of F' on the true pitch rate, by eq. 39, shows that F' cancels the notch filter.
    on_rate = (gain @ from_true_rate(notch)[np.ix_(kept, kept)])[1, PITCH_RATE]
    check = recomputed(subject, f"{field}.elevator_on_pitch_rate", on_rate, "feedback gain")
    yield replace(check, fields=(f"{field}.elevator_on_pitch_rate", f"{field}.gain"))
    structured = design.feedback_gain[1, PITCH_RATE]
    yield recomputed(subject, f"{field}.structured_elevator_on_pitch_rate", structured, "copied")
    target = subject.stated("inputs.nominal.target")
    for coupling in subject.vehicle.couplings:
        vehicle = subject.vehicle.coupled(coupling)
        at = trim(vehicle, target["altitude"], target["velocity"])
        jacobian = extended_jacobian(extended_state(at.state, notch), at.input, vehicle, notch, False)
        A, B = zero_order_hold(*jacobian, design.period)
        for name, values in (("structured", design.feedback_gain[:, :N_RIGID]), ("full_state", gain)):
            F = np.zeros((N_INPUTS, len(A)))
            F[:, kept[: values.shape[1]]] = values
            pole = float(np.log(radii(A + B @ F)) / design.period)
            yield recomputed(subject, f"{field}.largest_real_part.{name}.{coupling}", pole, "rightmost poles")
            if name == "structured":
                yield at_most(f"rightmost pole of the coupled vehicle, {coupling} coupling", pole, 0.0)


# --- before a flight --------------------------------------------------------------------------------------------------

Part = Callable[[Subject], Checks]

QUICK: dict[str, Part] = {
    "inputs": input_checks,
    "feedback gain": feedback_checks,
    "nominal gains": nominal_checks,
    "invariant set": set_checks,
    "adjustable factor": factor_checks,
}
"""Checks by part that do not recompute the polytopic model; the node of the tube law runs them before a flight."""

RECOMPUTED: dict[str, Part] = {
    "statement": statement_checks,
    "polytopic model": model_checks,
    "adjustable design": adjustable_checks,
    "counter-examples": counter_example_checks,
    "limited rates": rated_checks,
    "disturbances in a step": step_checks,
}
"""Checks by part that take a few seconds."""


def preflight(design: ControlDesign, certificate: str = "") -> str:
    """Check a design before a flight; return a warning, or an empty string.

    A modified design may fly as long as the conditions for its safety hold. The gains are stable at every vertex; F has
    a common Lyapunov function (eq. 24), and so has every K (eq. 34). The invariant set monitored in flight is the
    certified one, it contains e = 0, and it is invariant at every vertex under the feedback in flight. Actuators, range
    of tau, ``nominal.filtered`` and ``nominal.interpolated`` are as certified. If one of these or any other required
    check fails, the design is refused. Of the other failing checks, the first is the warning. A missing certificate is
    a warning, too, if none is named and none lies next to the design.

    Args:
        design: The design to check.
        certificate: Path of the certificate; empty: the one next to the parameter file found by the design's name.

    Raises:
        DesignError: A required check fails, or the certificate that is named or found cannot be read.
    """
    path = find_certificate(design.name, certificate)
    if path is None:
        return f"design {design.name!r}: no certificate found, not verified"
    subject = Subject(design, read_certificate(path))
    checks = [check for name, part in QUICK.items() for check in gathered(name, partial(part, subject))]
    failing = [check for check in checks if not check.ok]
    refused = next((check for check in failing if check.required), None)
    if refused:
        raise DesignError(f"design {design.name!r}: check fails: {refused}")
    return f"design {design.name!r} is not as certified: {failing[0]}" if failing else ""

"""Functions that return numbers for the claims, in the order of the paper.

Other numbers of the claims come directly from certificates and measures of flights. A claim names its function in
``claims.yaml``. Such a function returns numbers (SI, dB or a stated unit) and words by name. An array has one element
per vehicle, the nominal one first; those of :func:`sets` have one per state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import eigh

from hsv.certificate.loops import ELEVATOR, Feedback
from hsv.certificate.margins import crossovers
from hsv.control.design import ControlDesign
from hsv.control.design_file import find_design, read_parameters
from hsv.control.nominal_law import FamilyLaw
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.notch_filter import NotchSection, discretise, flown_sections, notch_response
from hsv.design.disturbance import DisturbanceSet
from hsv.design.tube import invariant_set
from hsv.design.tube_problem import tube_problem
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.corners import Corner, fraction
from hsv.flight.disturbance import ChannelModel
from hsv.flight.flight import Flight
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.lmi.semidefinite import spectral_radii
from hsv.model.lpv.linearisation import bode, bode_difference, frequency_response
from hsv.model.signals import CHANNELS, N_RIGID, PITCH_RATE
from hsv.model.vehicle import Vehicle, load_vehicle
from hsv_paper import modes
from hsv_paper.claims.evidence import Evidence, worst
from hsv_paper.designs import (
    CODESIGN_FREQUENCIES,
    certificate,
    codesigned_model,
    design,
    extended_model,
    inputs_of,
    tube_of,
)
from hsv_paper.figures.frequency import POLE_DAMPINGS, POLE_FREQUENCIES
from hsv_paper.flights import Point, flight_of, fly_over
from hsv_paper.linear_loop import TARGET, critical_coupling

Numbers = dict[str, Any]

SLOWEST_ELASTIC = 8.0
"""rad/s: half the lower structural frequency of the elastic modes. Slower modes belong to the rigid body."""

RIGID = 10.0
"""rad/s: a frequency between those of the rigid body and those of the elastic modes."""

FAMILY = "case1_rmpc_fourth_k"
"""A scenario with robust MPC that flies one gain of the nested family."""


# Section 3.1: the polytopic model and its disturbances.


def vertices(evidence: Evidence) -> Numbers:
    """Return the number of vertices of the polytopic model, for the baseline and for the adjustable design."""
    return {name: float(len(design(name).polytope.A)) for name in ("baseline", "adjustable")}


def coupling(evidence: Evidence) -> Numbers:
    """Return the largest relative changes of an elastic mode's frequency due to paper-like and derived coupling.

    ``almost``: the largest such change that counts as none, a tenth of the relative distance of the two modes.
    ``raised``: the largest change (dB) of the pitch rate's response to the elevator due to paper-like coupling.
    """
    vehicle = load_vehicle().decoupled
    structural = {"first": vehicle.natural_frequency_1, "second": vehicle.natural_frequency_2}

    def shift(name: str) -> float:
        return max(abs(mode.natural_frequency / structural[n] - 1.0) for n, mode in modes.elastic_modes(name).items())

    return {
        "raised": float(np.abs(_rise()).max()),
        "paper_like": shift("paper_like"),
        "derived": shift("derived"),
        "almost": 0.1 * abs(structural["second"] / structural["first"] - 1.0),
    }


def _rise() -> np.ndarray:
    """Return by how much (dB) paper-like coupling raises the pitch-rate response, at :data:`modes.FREQUENCIES`."""
    coupled, alone = (bode(modes.pitch_rate_response(name, modes.FREQUENCIES))[0] for name in ("paper_like", 0.0))
    return coupled - alone


def disturbance(evidence: Evidence) -> Numbers:
    """Return how many flights are compared with W and, for derived coupling, with ``share`` times W; and this share."""
    other = certificate("baseline_derived")
    return {
        "flights": certificate("baseline")["tube"]["flights"]["flights"],
        "share": other["inputs"]["disturbance"]["share"],
        "flights_derived": other["tube"]["flights"]["flights"],
    }


# Section 3.2: the baseline controller, its set and its inputs.


def box(evidence: Evidence) -> Numbers:
    """Return the spectral radius of the entrywise maximum of |A_i + B_i F| over the vertices i of the baseline.

    Below 1, it would prove that the paper's invariant box (eq. 25 to eq. 28) exists. The box is Z = {|e| <= z}; w_i are
    the half-widths of the disturbance at vertex i. By the Farkas lemma (the paper's Lemma 2), condition (eq. 27) is
    |A_i + B_i F| z + w_i <= z at every vertex. If |A_i + B_i F| has a spectral radius of at least one at some vertex,
    no z exists for w_i > 0: with the matrix's left Perron vector y, y'z + y'w_i <= y'z would follow. The absolute value
    hides the signs that make integrators and oscillating pairs stable.
    """
    flown = design("baseline")
    largest = np.abs(flown.polytope.A + flown.polytope.B @ flown.feedback_gain).max(axis=0)
    return {"radius": float(np.abs(np.linalg.eigvals(largest)).max())}


def symmetric(evidence: Evidence) -> Numbers:
    """Return the largest |centre| / half-width of W's channels, with the channel, and the largest one of Z's states."""
    tube = tube_of("baseline")
    channels = certificate("baseline")["tube"]["disturbance"]["channels"]
    off = {name: abs(b["upper"] + b["lower"]) / (b["upper"] - b["lower"]) for name, b in channels.items()}
    name = max(off, key=lambda channel: off[channel])
    ratio = float(np.abs(tube.centre / tube.half_width).max())
    return {"channel": name.replace("_", " "), "disturbance": off[name], "set": ratio}


def certified_attitude(evidence: Evidence) -> Numbers:
    """Return the half-width (rad) of the baseline's invariant set in angle of attack or pitch angle, the larger one."""
    return {"attitude": float(tube_of("baseline").half_width[2:4].max())}


def input_set(evidence: Evidence) -> Numbers:
    """Return, by input, the width of the range U ⊖ FZ and the nominal input's smallest distance from its ends, SI."""
    tightening = certificate("baseline")["tube"]["tightening"]
    widths = np.array(tightening["upper"]) - np.array(tightening["lower"])
    rooms = np.minimum(tightening["plan"]["margin_to_lower"], tightening["plan"]["margin_to_upper"])
    return {"fuel": widths[0], "elevator": widths[1], "room_fuel": rooms[0], "room_elevator": rooms[1]}


def kept_of_level(A: np.ndarray, B: np.ndarray, gain: np.ndarray, shape: np.ndarray) -> float:
    """Return the largest ratio of x' P x after a step to that before it, under u = K x, over all vertices and states.

    Below 1, x' P x decreases in every step. The ratio is the maximum over the whole polytope, because x' P x is convex.
    ``A`` (r, n, n) and ``B`` (r, n, m) are those of the vertices, ``gain`` (m, n) is K and ``shape`` (n, n) is P.
    """
    return max(float(eigh(M.T @ shape @ M, shape, eigvals_only=True)[-1]) for M in A + B @ gain)


def nominal_law(evidence: Evidence) -> Numbers:
    """Return ``kept``, the largest :func:`kept_of_level` of the nominal gains, each with its own ellipsoid.

    ``first``, ``highest``: values of x_n' P x_n in Case 1, P of the outermost ellipsoid; ``left``: last / ``first``.
    """
    flown = design("baseline")
    A, B = flown.polytope.A[:, :N_RIGID, :N_RIGID], flown.polytope.B[:, :N_RIGID]
    pairs = zip(flown.nominal_gains, flown.nominal_ellipsoids, strict=True)
    outermost = flown.nominal_ellipsoids[0]
    x = flight_of("case1").history.deviation[:, : len(outermost)]
    level = np.einsum("ki,ij,kj->k", x, outermost, x)
    return {
        "kept": max(kept_of_level(A, B, gain[:, :N_RIGID], shape) for gain, shape in pairs),
        "left": float(level[-1] / level[0]),
        "first": float(level[0]),
        "highest": float(level.max()),
    }


def nominal_inputs(evidence: Evidence) -> Numbers:
    """Return the largest ratio of a nominal input |u_n| to its bound in Case 1, flown by the nominal vehicle."""
    flown = design("baseline")
    law = FamilyLaw(nominal_data(flown))
    planned = np.abs([law.step(deviation).input for deviation in flight_of("case1").history.deviation])
    return {"used": float((planned / flown.nominal_input_bound).max())}


# Section 3.3: the modes of the coupled model, and the notch filter in the open loop.


def seven_modes(evidence: Evidence) -> Numbers:
    """Return how many elastic and how many rigid-body modes the coupled model has, and how many rigid-body poles."""
    found = modes.open_loop_modes("paper_like")
    rigid = [mode for mode in found if mode.natural_frequency < SLOWEST_ELASTIC]
    poles = sum(1 + (mode.pole.imag > 0.0) for mode in rigid)
    return {"elastic": len(found) - len(rigid), "rigid": len(rigid), "poles": poles}


def underdamped(evidence: Evidence) -> Numbers:
    """Return the larger elastic damping ratio, and the rise (dB) due to coupling at the peak of each elastic mode."""
    raised = _rise()
    first, second = (float(np.interp(peak.frequency, modes.FREQUENCIES, raised)) for peak in modes.peaks(()).values())
    return {
        "damping": max(mode.damping_ratio for mode in modes.elastic_modes("paper_like").values()),
        "first": first,
        "second": second,
    }


def coupling_in_pitch_rate(evidence: Evidence) -> Numbers:
    """Return the pitch rate's shares of three effects of paper-like coupling, which are scaled changes.

    A share is the pitch rate's sum of squares divided by that of all rigid-body states. ``onto_rigid``: changes of the
    entries of A by which elastic states act on rigid-body ones. ``onto_elastic``: of those by which rigid-body states
    act on elastic ones. ``answer``: of the rigid-body states' responses to the elevator.
    """
    scale = np.array(list(certificate("baseline")["inputs"]["model"]["tensor_product"]["state_scale"].values()))
    models = [modes.linearised(name) for name in ("paper_like", 0.0)]
    change = ((models[0][0] - models[1][0]) * scale / scale[:, None]) ** 2
    onto_rigid, onto_elastic = change[:N_RIGID, N_RIGID:], change[N_RIGID:, :N_RIGID]
    answer, alone = (frequency_response(*model, modes.FREQUENCIES)[:, :N_RIGID, ELEVATOR] for model in models)
    moved = np.abs((answer - alone) / scale[:N_RIGID]) ** 2
    return {
        "onto_rigid": onto_rigid[PITCH_RATE].sum() / onto_rigid.sum(),
        "answer": moved[:, PITCH_RATE].sum() / moved.sum(),
        "onto_elastic": onto_elastic[:, PITCH_RATE].sum() / onto_elastic.sum(),
    }


def falls(evidence: Evidence) -> Numbers:
    """Return by how much (dB) notch filters reduce the peaks of the first and the second elastic mode.

    ``first``, ``second``: by the baseline's filter. ``least``: the smallest reduction of the first peak by a filter of
    Figure 3. ``first_centred``, ``second_centred``: reduction of either peak by a filter centred at its mode.
    """
    section, at = design("baseline").notch[0], modes.elastic_modes("paper_like")["first"].natural_frequency
    changed = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES]
    changed += [replace(section, pole_damping=damping) for damping in POLE_DAMPINGS]
    second_mode = flown_sections(flight_parameters(load_scenario("case1_second_mode_notch")))
    return {
        **modes.peak_falls([section]),
        "least": min(modes.peak_falls([one])["first"] for one in changed),
        "first_centred": modes.peak_falls([replace(section, zero_frequency=at, pole_frequency=at)])["first"],
        "second_centred": modes.peak_falls(second_mode)["second"],
    }


def passed(evidence: Evidence) -> Numbers:
    """Return the effects of the baseline's filter away from its centre: phase lags (rad) and gains (dB).

    ``crossover``: that of the rigid body (rad/s) in the loop without filter. ``lag``, ``slow_lag``: the filter's phase
    lags there and at 1 rad/s. ``second``: the reduction of the second mode's peak. ``above``: |gain| in dB at ten times
    the centre. ``unmatched``: the smallest one there with Figure 3's pole frequencies other than the centre.
    """
    section, crossover = design("baseline").notch[0], float(margins(evidence, {}, notched=False)[0, 0])
    slow_lag, lag = -np.angle(notch_response([section], np.array([1.0, crossover])))
    far = np.array([10.0 * section.zero_frequency])
    changed = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES if w != section.zero_frequency]
    above, *unmatched = (abs(bode(notch_response([one], far))[0][0]) for one in (section, *changed))
    return {
        "crossover": crossover,
        "second": modes.peak_falls([section])["second"],
        "lag": lag,
        "slow_lag": slow_lag,
        "above": above,
        "unmatched": min(unmatched),
    }


def unit_circle(evidence: Evidence) -> Numbers:
    """Return how far zeros of the discrete filter are from the unit circle: the baseline's, and undamped (``ideal``).

    ``gained``: by how much more (dB) undamped zeros reduce the first mode's peak.
    """
    ours = design("baseline").notch[0]
    ideal = replace(ours, zero_damping=0.0)

    def distance(section: NotchSection) -> float:
        data = discretise((section,), design("baseline").period)
        zeros = np.linalg.eigvals(data.A[0] - np.outer(data.B[0], data.C[0]) / data.D[0])
        return float(np.abs(np.abs(zeros) - 1.0).max())

    return {
        "ideal": distance(ideal),
        "ours": distance(ours),
        "zero_damping": ours.zero_damping,
        "gained": modes.peak_falls([ideal])["first"] - modes.peak_falls([ours])["first"],
    }


# Section 3.3: the loop and its flights with and without the notch filter.


def without_notch(evidence: Evidence) -> Numbers:
    """Return the growths (1/s) of the baseline's loops without notch filter, by vehicle, and the coupling's margin.

    ``margin``: the coupling at which the nominal vehicle's loop becomes unstable (inf: none), over the paper-like one.
    """
    limit = critical_coupling(Feedback.of(design("baseline"), notched=False, hardware=evidence.hardware))
    return {
        "paper_like": evidence.growth("paper_like", ()),
        "derived": evidence.growth("derived", ()),
        "margin": float("inf") if limit is None else limit / load_vehicle().coupling_scale("paper_like"),
    }


def with_notch(evidence: Evidence) -> Numbers:
    """Return the growths (1/s) of the loops with notch filter, by vehicle, and the filters' centres (rad/s).

    ``retuned`` and ``centre_derived`` belong to the design ``baseline_derived``, the others to ``baseline``.
    """
    notch, other = design("baseline").notch, design("baseline_derived").notch
    return {
        "paper_like": evidence.growth("paper_like", notch),
        "derived": evidence.growth("derived", notch),
        "retuned": evidence.growth("derived", other, "baseline_derived"),
        "centre": notch[0].zero_frequency,
        "centre_derived": other[0].zero_frequency,
    }


def margins(evidence: Evidence, corner: Corner, *, notched: bool) -> np.ndarray:
    """Return frequency (rad/s) and phase margin (rad) at the n crossovers of the elevator loop, shape (n, 2).

    The loop is the baseline's, at Case 1's target without the fault. Frequencies increase; the first crossover is the
    rigid body's. All margins of an unstable loop are negative. ``corner``: relative changes of vehicle parameters.
    """
    flown = design("baseline")
    # The grid is fine near the modes, where the loop gain barely reaches 1.
    top = 0.95 * np.pi / flown.period
    frequencies = np.unique(np.concatenate((np.geomspace(0.1, top, 3000), np.linspace(12.0, 22.0, 5001))))
    vehicle = load_vehicle().coupled("paper_like").perturbed(corner)
    loop = Feedback.of(flown, notched=notched, hardware=evidence.hardware).around(vehicle, TARGET)
    sign = 1.0 if loop.growth < 0.0 else -1.0
    found = [(at, sign * min(lag, 2.0 * np.pi - lag)) for at, lag in crossovers(loop.broken("elevator"), frequencies)]
    return np.array(found)


def phase_margin(evidence: Evidence) -> Numbers:
    """Return by how much (rad) the notch filter raises phase margins, with the loop broken at the elevator.

    ``gained``: the rise of the smallest margin of all crossovers, by vehicle. ``rigid``: the rise at the rigid-body
    crossover of the nominal vehicle; the margin without the filter counts as positive there, even if unstable.
    """
    pairs = [
        [margins(evidence, corner, notched=notched)[:, 1] for notched in (False, True)] for corner in evidence.over
    ]
    gained = np.array([after.min() - before.min() for before, after in pairs])
    before, after = pairs[0]
    return {"gained": gained, "rigid": after[0] - abs(before[0])}


def less_uncertainty(evidence: Evidence) -> Numbers:
    """Return, for two channels of W, the largest disturbance in Case 1 with notch filter divided by that without.

    The vehicles are those of ``evidence`` in :func:`fraction`; ``pitch_nominal``: pitch acceleration, nominal one only.
    """
    over = [corner for corner in fraction(load_vehicle().uncertainty) if corner in evidence.over]
    a, b = (largest_disturbances(scenario, over) for scenario in ("case1", "case1_no_notch"))
    return {channel: a[channel].max() / b[channel].max() for channel in ("pitch_acceleration", "acceleration")} | {
        "pitch_nominal": a["pitch_acceleration"][0] / b["pitch_acceleration"][0]
    }


def largest_disturbances(scenario: str, over: Sequence[Corner]) -> dict[str, np.ndarray]:
    """Return, by channel of W, its largest magnitude (SI) in each flight of ``scenario``, shape (flights,).

    The channels are measured as in the design of W. ``over`` are relative changes of the vehicle, one for each flight.
    """
    values = flight_parameters(load_scenario(scenario))
    sections = tuple(assemble(values).notch_filter.sections)
    model = ChannelModel(
        replace(ControlDesign.from_parameters(values), notch=sections), Vehicle.from_parameters(values)
    )

    def largest(corner: Corner, flight: Flight) -> np.ndarray:
        return np.asarray(np.abs(model.channels(flight)).max(axis=0))

    rows = np.array(fly_perturbed(assemble(values), over, largest))
    return {channel.name: column for channel, column in zip(CHANNELS, rows.T, strict=True)}


# Section 4: the co-designed model, its gains and its sets.


def conforms(evidence: Evidence) -> Numbers:
    """Return the largest differences (dB, deg) of the co-designed model from the extended coupled model (eq. 40).

    They are those of the response of filtered pitch rate to elevator; ``low_magnitude``: below ``rigid`` (rad/s) only.
    """
    frequencies, inputs = CODESIGN_FREQUENCIES, inputs_of("adjustable")
    low = frequencies < RIGID
    model, ecm = (
        frequency_response(*system, frequencies, inputs.model.period)[:, PITCH_RATE, ELEVATOR]
        for system in (codesigned_model(inputs), extended_model(inputs, "paper_like"))
    )
    decibel, degree = bode_difference(model, ecm)
    return {"magnitude": decibel.max(), "phase": degree.max(), "low_magnitude": decibel[low].max(), "rigid": RIGID}


def stabilises(evidence: Evidence) -> Numbers:
    """Return 1 minus the largest closed-loop spectral radius over all nominal gains and vertices of ``adjustable``."""
    flown = design("adjustable")
    A, B = flown.polytope.A, flown.polytope.B
    radius = max(float(spectral_radii(A + B @ gain).max()) for gain in flown.nominal_gains)
    return {"decay": 1.0 - radius}


@cache
def sets(evidence: Evidence) -> Numbers:
    """Return half-widths of invariant sets divided, state by state, by those of Z.

    Z is the set under the adjustable design's gain F', at tau = 1, for the complete W. ``measured``, ``halved``: sets
    under F' for W', measured with smaller uncertainty and fault, and for W / 2. ``flown``: Z', the design's own set;
    ``mean``: mean of ``flown`` over the states. ``flown_scaled``: ``flown`` divided by tau, to compare Z' with tau Z.
    """
    flown, inputs, ones = design("adjustable"), inputs_of("adjustable"), np.ones(N_RIGID)
    complete, incomplete = (
        DisturbanceSet.from_report(certificate("adjustable")["adjustable"][name]["disturbance"]["channels"])
        for name in ("complete", "incomplete")
    )
    under_F = replace(flown, tau=ones, tau_minimum=ones)
    whole, measured, halved = (
        invariant_set(tube_problem(under_F, inputs.flown_vehicle, W), inputs.invariant_set).half_width
        for W in (complete, incomplete, complete.scaled(0.5))
    )
    ratio = tube_of("adjustable").half_width / whole
    return {
        "halved": halved / whole,
        "measured": measured / whole,
        "flown": ratio,
        "flown_scaled": ratio / _tau(),
        "mean": ratio.mean(),
    }


def relaxed(evidence: Evidence) -> Numbers:
    """Return the bounds of the nominal inputs of the adjustable design, divided by those of the baseline."""
    ratio = design("adjustable").nominal_input_bound / design("baseline").nominal_input_bound
    return {"fuel": ratio[0], "elevator": ratio[1]}


def adjustable_step(evidence: Evidence) -> Numbers:
    """Return tau, and the ratio of the velocity's settling times in nominal Case 1, adjustable design to baseline."""
    values = {**read_parameters(find_design("adjustable")), **load_scenario("case1").parameters()}
    tables = fly_over(Point(values, [{}])), evidence.corners("case1")
    adjustable, baseline = (float(table["velocity_settling_time"][0]) for table in tables)
    return {"tau": _tau(), "velocity": adjustable / baseline}


def less_robust(evidence: Evidence) -> Numbers:
    """Return tau, and the worst attitude deviation after Case 2's fault relative to that at tau = 1."""
    ramp, whole = (
        worst(evidence.magnitudes(name, "post_fault_attitude_from_nominal")) for name in ("case2", "case2_tau1")
    )
    return {"tau": _tau(), "attitude": ramp / whole}


def further_stable(evidence: Evidence) -> Numbers:
    """Return tau, and the growths (1/s, by vehicle) of the adjustable loops at tau minus those at tau = 1."""
    flown, tau = design("adjustable"), _tau()
    like, derived = (
        [evidence.growth(coupling, flown.notch, "adjustable", factor) for factor in (tau, 1.0)]
        for coupling in ("paper_like", "derived")
    )
    return {"tau": tau, "paper_like": like[0] - like[1], "derived": derived[0] - derived[1]}


def _tau() -> float:
    return float(design("adjustable").tau.min())


# Section 5.2: robust MPC, the elastic modes and the inputs in flight.


def rmpc_flexible(evidence: Evidence) -> Numbers:
    """Return how many gains robust MPC has, and with how many the nominal vehicle is lost at derived coupling."""
    changes = ("vehicle.model", "CM"), ("vehicle.coupling", "derived")
    gains = range(len(design("baseline").nominal_gains))
    lost = [evidence.changed(FAMILY, ("robust_mpc.gain_index", gain), *changes)["diverged"] for gain in gains]
    return {"gains": len(lost), "lost": sum(lost)}


def rmpc_altitude(evidence: Evidence) -> Numbers:
    """Return the magnitude (m) of the altitude error at the end of Case 1 under robust MPC with its last gain."""
    last = ("robust_mpc.gain_index", len(design("baseline").nominal_gains) - 1)
    return {"last_error": abs(evidence.changed(FAMILY, last)["altitude_end_error"])}


def rejected_derived(evidence: Evidence) -> Numbers:
    """Return 1 if the flight without notch filter is lost at the derived coupling, otherwise 0."""
    return {"lost": evidence.changed("case1_derived_no_notch")["diverged"]}

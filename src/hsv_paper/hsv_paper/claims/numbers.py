"""Computations for claims that neither certificates nor flights provide, in the order of the paper.

A claim names its function in ``claims.yaml``. Each returns numbers (SI) and words by name; an array has an element for
each vehicle, the nominal one first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import eigh

from hsv.base.units import to_paper
from hsv.control.design import ControlDesign, find_design, read_parameters
from hsv.control.nominal_law import FamilyLaw
from hsv.control.nominal_trajectory import nominal_data
from hsv.control.notch_filter import NotchSection, discretise, flown_sections, notch_response
from hsv.control.optimisation import spectral_radii
from hsv.design.disturbance import CHANNELS, ChannelModel, DisturbanceSet
from hsv.design.tube import invariant_set
from hsv.design.tube_problem import tube_problem
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.corners import Corner, fraction
from hsv.flight.flight import Flight
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.dynamics import VehicleParameters
from hsv.model.lpv.linearisation import bode, bode_difference, frequency_response
from hsv.model.signals import N_RIGID, PITCH_RATE
from hsv.model.vehicle import Vehicle, load_vehicle
from hsv_paper.box import infeasibility
from hsv_paper.claims.evidence import Evidence, nominal, shown, worst
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
from hsv_paper.flights import Point, fly_over
from hsv_paper.linear_loop import COUPLING_SCALES, ELEVATOR, TARGET, Feedback, Margin, phase_margins
from hsv_paper.modes import FREQUENCIES, elastic_modes, linearised, open_loop_modes, peak_falls, pitch_rate_response

Numbers = dict[str, Any]

SLOWEST_ELASTIC = 8.0
"""rad/s: half the lower structural frequency; slower modes belong to the rigid body."""

RIGID = 10.0
"""rad/s: frequency between the rigid body and the elastic modes."""

FAMILY = "case1_rmpc_fourth_k"
FLOWN_GAIN = 3
"""A scenario of robust MPC, and the index in the nested family of the gain that it flies."""


# Section 3.1: the polytopic model and its disturbances.


def vertices(evidence: Evidence, name: str = "baseline") -> Numbers:
    """Return the number of vertices of a design's model, and the relative tolerance of the singular values."""
    rows, columns = certificate(name)["model"]["vertices"]
    tolerance = certificate(name)["inputs"]["model"]["tensor_product"]["tolerance"]
    return {"rows": rows, "columns": columns, "count": float(rows * columns), "tolerance": tolerance}


def coupling(evidence: Evidence) -> Numbers:
    """Return the effect of coupling on the modes and on the pitch-rate response.

    ``almost``: the largest relative shift of a mode that counts as none, a tenth of the distance of the two modes.
    """
    vehicle = load_vehicle().decoupled
    structural = {"first": vehicle.natural_frequency_1, "second": vehicle.natural_frequency_2}

    def shift(name: str) -> float:
        return max(abs(mode.natural_frequency / structural[n] - 1.0) for n, mode in elastic_modes(name).items())

    return {
        "raised": float(np.abs(_rise()).max()),
        "paper_like": shift("paper_like"),
        "derived": shift("derived"),
        "almost": 0.1 * abs(structural["second"] / structural["first"] - 1.0),
    }


def _rise() -> np.ndarray:
    """Return the increase (dB) by coupling of the pitch-rate response to the elevator, about the elastic modes."""
    coupled, alone = (bode(pitch_rate_response(name, FREQUENCIES))[0] for name in ("paper_like", 0.0))
    return coupled - alone


def disturbance(evidence: Evidence) -> Numbers:
    """Return the number of flights on which W was measured, and the number of those that leave it."""
    tube, inputs = certificate("baseline")["tube"], certificate("baseline")["inputs"]
    other = certificate("baseline_derived")
    return {
        "measured": tube["disturbance"]["flights"] - 1,
        "inflation": inputs["disturbance"]["inflation"],
        "flights": tube["flights"]["flights"],
        "corners": tube["flights"]["flights"] - 1,
        "share": other["inputs"]["disturbance"]["share"],
        "outside": other["tube"]["flights"]["disturbance_membership"]["outside"],
        "flights_derived": other["tube"]["flights"]["flights"],
    }


# Section 3.2: the baseline controller, its set and its inputs.


def box(evidence: Evidence) -> Numbers:
    """Return the spectral radius that must be below 1 for the paper's box to exist."""
    flown = design("baseline")
    bounds = certificate("baseline")["tube"]["disturbance"]["boxes"]["delta"]
    half_width = 0.5 * np.subtract(bounds["upper"], bounds["lower"])
    return {"radius": infeasibility(flown.polytope.A + flown.polytope.B @ flown.feedback_gain, half_width).radius}


def symmetric(evidence: Evidence) -> Numbers:
    """Return the distances of the centres of W and Z from zero, relative to their half-widths."""
    tube = tube_of("baseline")
    channels = certificate("baseline")["tube"]["disturbance"]["channels"]
    off = {name: abs(b["upper"] + b["lower"]) / (b["upper"] - b["lower"]) for name, b in channels.items()}
    name = max(off, key=lambda channel: off[channel])
    ratio = float(np.abs(tube.centre / tube.half_width).max())
    return {"channel": name.replace("_", " "), "disturbance": off[name], "set": ratio}


def certified_attitude(evidence: Evidence) -> Numbers:
    """Return the half-width (rad) of the invariant set in the attitude angles."""
    return {"attitude": float(tube_of("baseline").half_width[2:4].max())}


def input_set(evidence: Evidence) -> Numbers:
    """Return the widths of U ⊖ FZ and the margins of the nominal trajectory in it."""
    tightening = certificate("baseline")["tube"]["tightening"]
    widths = np.array(tightening["upper"]) - np.array(tightening["lower"])
    rooms = np.minimum(tightening["plan"]["margin_to_lower"], tightening["plan"]["margin_to_upper"])
    return {"fuel": widths[0], "elevator": widths[1], "room_fuel": rooms[0], "room_elevator": rooms[1]}


def kept_of_level(A: np.ndarray, B: np.ndarray, gain: np.ndarray, shape: np.ndarray) -> float:
    """Return the largest factor per step on x' P x under u = K x over vertices and states; below 1 it decreases.

    The factor applies to the whole polytope, because x' P x is convex.

    Args:
        A: (r, n, n) vertices.
        B: (r, n, m).
        gain: (m, n) K.
        shape: (n, n) P.
    """
    return max(float(eigh(M.T @ shape @ M, shape, eigvals_only=True)[-1]) for M in A + B @ gain)


def nominal_law(evidence: Evidence) -> Numbers:
    """Return the factors on the Lyapunov functions of the nominal gains, and the level of x_n over the flights."""
    flown = design("baseline")
    A, B = flown.polytope.A[:, :N_RIGID, :N_RIGID], flown.polytope.B[:, :N_RIGID]
    pairs = zip(flown.nominal_gains, flown.nominal_ellipsoids, strict=True)
    outermost = flown.nominal_ellipsoids[0]
    step, ramp = (
        np.einsum("ki,ij,kj->k", x, outermost, x)
        for x in (evidence.flights[name].deviation[:, : len(outermost)] for name in ("case1", "case2_baseline"))
    )
    return {
        "gains": len(flown.nominal_gains),
        "kept": max(kept_of_level(A, B, gain[:, :N_RIGID], shape) for gain, shape in pairs),
        "rise": float(np.diff(step).max()),
        "left": float(step[-1] / step[0]),
        "first": float(step[0]),
        "highest": float(step.max()),
        "highest_ramp": float(ramp.max()),
    }


def nominal_inputs(evidence: Evidence) -> Numbers:
    """Return the share used of the nominal inputs' bounds, and the velocity error (ft/s) with a single K."""
    single = abs(evidence.changed("case1_single_k")["velocity_end_error"])
    return {"used": _used_inputs(evidence, "case1", "baseline"), "single": to_paper(single, "m/s")[0]}


def _used_inputs(evidence: Evidence, scenario: str, name: str) -> float:
    """Return the largest share that the nominal input takes of its bound over a nominal flight."""
    flown = design(name)
    law = FamilyLaw(nominal_data(flown))
    planned = np.abs([law.step(deviation).input for deviation in evidence.flights[scenario].deviation])
    return float((planned / flown.nominal_input_bound).max())


# Section 3.3: the modes of the coupled model, and the notch filter in the open loop.


def seven_modes(evidence: Evidence) -> Numbers:
    """Return the numbers of elastic and rigid-body modes of the coupled model, and of the rigid body's poles."""
    found = open_loop_modes("paper_like")
    rigid = [mode for mode in found if mode.natural_frequency < SLOWEST_ELASTIC]
    poles = sum(1 + (mode.pole.imag > 0.0) for mode in rigid)
    return {"all": len(found), "elastic": len(found) - len(rigid), "rigid": len(rigid), "poles": poles}


def underdamped(evidence: Evidence) -> Numbers:
    """Return damping and real parts of the elastic modes, the rise at their peaks, and the unstable pole."""
    elastic, raised = list(elastic_modes("paper_like").values()), _rise()
    first, second = (float(np.interp(fall.before.frequency, FREQUENCIES, raised)) for fall in peak_falls(()).values())
    return {
        "damping": max(mode.damping_ratio for mode in elastic),
        "first": first,
        "second": second,
        "pole_1": elastic[0].pole.real,
        "pole_2": elastic[1].pole.real,
        "unstable": max(mode.pole.real for mode in open_loop_modes("paper_like")),
    }


def coupling_in_pitch_rate(evidence: Evidence) -> Numbers:
    """Return the shares of the pitch rate in the effects of coupling."""
    scale = np.array(list(certificate("baseline")["inputs"]["model"]["tensor_product"]["state_scale"].values()))
    models = [linearised(name) for name in ("paper_like", 0.0)]
    change = ((models[0][0] - models[1][0]) * scale / scale[:, None]) ** 2
    onto_rigid, onto_elastic = change[:N_RIGID, N_RIGID:], change[N_RIGID:, :N_RIGID]
    answer, alone = (frequency_response(*model, FREQUENCIES)[:, :N_RIGID, ELEVATOR] for model in models)
    moved = np.abs((answer - alone) / scale[:N_RIGID]) ** 2
    return {
        "onto_rigid": onto_rigid[PITCH_RATE].sum() / onto_rigid.sum(),
        "answer": moved[:, PITCH_RATE].sum() / moved.sum(),
        "onto_elastic": onto_elastic[:, PITCH_RATE].sum() / onto_elastic.sum(),
    }


def _falls(sections: Sequence[NotchSection], coupling: str = "paper_like") -> dict[str, float]:
    """Return the reduction (dB) of the peak of each mode."""
    return {name: fall.decibel for name, fall in peak_falls(sections, coupling).items()}


def peaks(evidence: Evidence) -> Numbers:
    """Return the reductions (dB) of both peaks, with the design's filter and with one centred at each mode."""
    section = design("baseline").notch[0]
    fall = peak_falls([section])
    at, left = fall["first"].natural_frequency, fall["first"].after
    other = _falls(flown_sections(flight_parameters(load_scenario("case1_second_mode_notch"))))
    return {
        "first": fall["first"].decibel,
        "second": fall["second"].decibel,
        "first_centred": _falls([replace(section, zero_frequency=at, pole_frequency=at)])["first"],
        "second_centred": other["second"],
        "centre": section.zero_frequency,
        "mode": at,
        "remains": "" if left is None else f" A peak of {left.magnitude:.1f} dB remains at {left.frequency:.2f} rad/s.",
    }


def falls(evidence: Evidence) -> Numbers:
    """Return the reductions (dB) of both peaks with each coupling's filter, and the smallest with Figure 3's poles."""
    section = design("baseline").notch[0]
    changed = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES]
    changed += [replace(section, pole_damping=damping) for damping in POLE_DAMPINGS]
    derived = _falls(design("baseline_derived").notch[:1], "derived")
    return _falls([section]) | {
        "least": min(_falls([one])["first"] for one in changed),
        "first_derived": derived["first"],
        "second_derived": derived["second"],
        "damping": section.pole_damping,
    }


def passed(evidence: Evidence) -> Numbers:
    """Return the effect of the filter off its centre: loss (dB), lag (rad), and the change of gain (dB) far off."""
    section, crossover = design("baseline").notch[0], margins(evidence, notched=False)[0].frequency
    response = notch_response([section], np.array([1.0, crossover]))
    (slow_loss, loss), (slow_lag, lag) = -bode(response)[0], -np.angle(response)
    centre = section.zero_frequency

    def change(one: NotchSection, frequency: float) -> float:
        return float(abs(bode(notch_response([one], np.array([frequency])))[0][0]))

    others = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES if w != centre]
    return {
        "crossover": crossover,
        "centre": centre,
        "second": _falls([section])["second"],
        "loss": loss,
        "lag": lag,
        "slow_loss": slow_loss,
        "slow_lag": slow_lag,
        "above": change(section, 10.0 * centre),
        "below": change(section, 0.1 * centre),
        "unmatched": min(change(one, 10.0 * centre) for one in others),
    }


def unit_circle(evidence: Evidence) -> Numbers:
    """Return the distance of the discrete filter's zeros from the unit circle, and the gain of a deeper notch."""
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
        "gained": _falls([ideal])["first"] - _falls([ours])["first"],
        "depth": -20.0 * np.log10(ours.zero_damping / ours.pole_damping),
    }


# Section 3.3: the loop and its flights with and without the notch filter.


def _critical(evidence: Evidence) -> float | None:
    """Return the share of the derived coupling at which the baseline's loop without notch becomes unstable."""
    return Feedback.of(design("baseline"), notched=False, hardware=evidence.hardware).critical_coupling()


def without_notch(evidence: Evidence) -> Numbers:
    """Return the growth (1/s) of the loops without the notch, and the coupling up to which they are stable."""
    growth, loop = evidence.growth("paper_like", ()), Feedback.of(design("baseline"), notched=False)
    share, limit = load_vehicle().coupling_scale("paper_like"), _critical(evidence)
    margin = float("inf") if limit is None else limit / share
    uncertain = assemble(flight_parameters(load_scenario("case1_uncertain_no_notch"))).plant.vehicle
    table, ringing = evidence.corners("case1_no_notch"), "elastic_rate_2_ringing"
    return {
        "paper_like": growth,
        "derived": evidence.growth("derived", ()),
        "uncertain": replace(loop, hardware=evidence.hardware).growth(uncertain),
        "margin": margin,
        "share": share,
        "limit": share * margin,
        "above": 100.0 * (margin - 1.0),
        "unstable": int(np.count_nonzero(growth > 0.0)),
        "ringing": worst(table, ringing) / nominal(table, ringing),
    }


def with_notch(evidence: Evidence) -> Numbers:
    """Return the growth, 1/s, of the loops with the notch; ``retuned``: derived coupling with its own design."""
    notch, other = design("baseline").notch, design("baseline_derived").notch
    derived = evidence.growth("derived", notch)
    return {
        "paper_like": evidence.growth("paper_like", notch),
        "derived": derived,
        "retuned": evidence.growth("derived", other, "baseline_derived"),
        "unstable": int(np.count_nonzero(derived > 0.0)),
        "centre": notch[0].zero_frequency,
        "centre_derived": other[0].zero_frequency,
    }


def margins(
    evidence: Evidence, vehicle: VehicleParameters | None = None, name: str = "baseline", *, notched: bool
) -> list[Margin]:
    """Return the margins of the loop broken at the elevator, the slowest crossover, the rigid body's, first.

    Those of an unstable loop are negative. ``vehicle``: paper-like and nominal unless given; ``name``: of the design.
    """
    flown = design(name)
    # The grid is fine near the modes, where the gain barely reaches 1.
    top = 0.95 * np.pi / flown.period
    frequencies = np.unique(np.concatenate((np.geomspace(0.1, top, 3000), np.linspace(12.0, 22.0, 5001))))
    loop = Feedback.of(flown, notched=notched, hardware=evidence.hardware).around(
        vehicle or load_vehicle().coupled("paper_like"), TARGET
    )
    sign = 1.0 if loop.growth < 0.0 else -1.0
    found = phase_margins(frequencies, loop.elevator_loop(frequencies))
    return sorted((replace(m, phase=sign * m.phase) for m in found), key=lambda margin: margin.frequency)


def phase_margin(evidence: Evidence) -> Numbers:
    """Return the effect (rad) of the notch on the phase margins of the loop broken at the elevator, by vehicle."""

    def smallest(margins: list[Margin]) -> float:
        return min(margin.phase for margin in margins)

    vehicles = [load_vehicle().coupled("paper_like").perturbed(corner) for corner in evidence.over]
    pairs = [(margins(evidence, v, notched=False), margins(evidence, v, notched=True)) for v in vehicles]
    gained, (before, after) = np.array([smallest(b) - smallest(a) for a, b in pairs]), pairs[0]
    derived = load_vehicle().coupled("derived")
    retuned = smallest(margins(evidence, derived, "baseline_derived", notched=True))
    return {
        "gained": gained,
        "rigid": after[0].phase - abs(before[0].phase),
        "derived": retuned - smallest(margins(evidence, derived, notched=False)),
        "smallest": np.degrees(smallest(before)),
        "crossover": before[0].frequency,
        "crossover_after": after[0].frequency,
        "before": np.degrees(before[0].phase),
        "after": np.degrees(after[0].phase),
        "no_gain": int(np.count_nonzero(gained < 0.0)),
    }


def less_uncertainty(evidence: Evidence) -> Numbers:
    """Return the largest lumped disturbances in flight with the notch over those without, by channel."""
    over = [corner for corner in fraction(load_vehicle().uncertainty) if corner in evidence.over]
    a, b = (largest_disturbances(scenario, over) for scenario in ("case1", "case1_no_notch"))
    reduced = ("pitch_acceleration", "acceleration", "lost_elevator")
    return {channel: a[channel].max() / b[channel].max() for channel in reduced} | {
        "pitch_nominal": a["pitch_acceleration"][0] / b["pitch_acceleration"][0],
        "flown": len(over),
    }


def largest_disturbances(scenario: str, over: Sequence[Corner]) -> dict[str, np.ndarray]:
    """Return by channel of W the largest magnitude (flights) over each flight of ``scenario``, SI.

    It is measured as the design measures W.

    Args:
        scenario: A shipped one under the tube law, with or without notch filter.
        over: Relative changes of the vehicle's parameters, one flight each.
    """
    values = flight_parameters(load_scenario(scenario))
    sections = tuple(assemble(values).notch_filter.sections)
    model = ChannelModel(
        replace(ControlDesign.from_parameters(values), notch=sections), Vehicle.from_parameters(values)
    )

    def largest(corner: Corner, flight: Flight) -> np.ndarray:
        return np.asarray(np.abs(model.signals(flight).channels).max(axis=0))

    rows = np.array(fly_perturbed(assemble(values), over, largest))
    return {channel.name: column for channel, column in zip(CHANNELS, rows.T, strict=True)}


def closer(evidence: Evidence) -> Numbers:
    """Return the reduction (%) by the notch of errors from the nominal trajectory, nominal vehicle."""
    whole, rate = (
        nominal(evidence.corners("case1"), measure) / nominal(evidence.corners("case1_no_notch"), measure)
        for measure in ("rigid_error", "pitch_rate_error")
    )
    return {"closer": 100.0 * (1.0 - whole), "closer_in_rate": 100.0 * (1.0 - rate)}


# Section 4: the co-designed model, its gains and its sets.


def codesign_vertices(evidence: Evidence) -> Numbers:
    """Return the vertices of the co-designed model, and number and tolerance of those of the baseline."""
    other = vertices(evidence)
    return vertices(evidence, "adjustable") | {"baseline": f"{other['count']:.0f}", "finer": other["tolerance"]}


def conforms(evidence: Evidence) -> Numbers:
    """Return the differences between the co-designed model and the ECM, and where they are largest."""
    frequencies, inputs = CODESIGN_FREQUENCIES, inputs_of("adjustable")

    def apart(coupling: str) -> tuple[np.ndarray, np.ndarray]:
        model, ecm = (
            frequency_response(*system, frequencies, inputs.model.period)[:, PITCH_RATE, ELEVATOR]
            for system in (codesigned_model(inputs), extended_model(inputs, coupling))
        )
        return bode_difference(model, ecm)

    (decibel, degree), low = apart("paper_like"), frequencies < RIGID
    return {
        "magnitude": decibel.max(),
        "phase": degree.max(),
        "low_magnitude": decibel[low].max(),
        "low_phase": degree[low].max(),
        "low_derived": apart("derived")[0][low].max(),
        "rigid": RIGID,
        "lowest": frequencies[0],
        "highest": frequencies[-1],
        "loud": frequencies[int(decibel.argmax())],
        "late": frequencies[int(degree.argmax())],
    }


def stabilises(evidence: Evidence) -> Numbers:
    """Return the smallest distance of the closed-loop spectral radius from 1 over gains and vertices."""
    flown = design("adjustable")
    A, B = flown.polytope.A, flown.polytope.B
    radius = max(float(spectral_radii(A + B @ gain).max()) for gain in flown.nominal_gains)
    return {"decay": 1.0 - radius, "gains": len(flown.nominal_gains), "vertices": len(A)}


@cache
def sets(evidence: Evidence) -> Numbers:
    """Return half-widths (7) relative to those of Z: of Z' as flown, and of the sets under F' for W' and W / 2."""
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
    moving = complete.half_width > 0.0
    shares = incomplete.half_width[moving] / complete.half_width[moving]
    return {
        "halved": halved / whole,
        "measured": measured / whole,
        "measured_scaled": measured / (_tau() * whole),
        "flown": ratio,
        "flown_scaled": ratio / _tau(),
        "mean": ratio.mean(),
        "altitude": ratio[0],
        "velocity": ratio[1],
        "least_share": shares.min(),
        "largest_share": shares.max(),
    }


def relaxed(evidence: Evidence) -> Numbers:
    """Return the bounds of the nominal inputs relative to the baseline's."""
    ratio = design("adjustable").nominal_input_bound / design("baseline").nominal_input_bound
    return {"fuel": ratio[0], "elevator": ratio[1]}


def adjustable_step(evidence: Evidence) -> Numbers:
    """Return the settling of the step of Case 1 relative to the baseline, and the inputs used by Case 2's ramp (%)."""
    values = {**read_parameters(find_design("adjustable")), **load_scenario("case1").parameters()}
    adjustable, baseline = fly_over(Point(values, [{}])), evidence.corners("case1")
    found: Numbers = {"tau": _tau(), "used": 100 * _used_inputs(evidence, "case2", "adjustable")}
    for axis in ("velocity", "altitude"):
        time, before = (nominal(table, f"{axis}_settling_time") for table in (adjustable, baseline))
        found |= {axis: time / before, f"{axis}_time": shown(time, "s"), f"{axis}_baseline": shown(before, "s")}
    return found


def less_robust(evidence: Evidence) -> Numbers:
    """Return the ratio between the worst vehicle with tau and the worst one with the whole feedback."""
    ramp, whole = evidence.corners("case2"), evidence.corners("case2_tau1")
    measures = {"attitude": "post_fault_attitude_from_nominal", "altitude": "altitude_end_error"}
    return {"tau": _tau()} | {name: worst(ramp, measure) / worst(whole, measure) for name, measure in measures.items()}


def further_stable(evidence: Evidence) -> Numbers:
    """Return the growth, 1/s, of the loops with tau minus that with 1, and the frequency of the slowest pole."""
    flown, tau = design("adjustable"), _tau()
    like, derived = (
        [evidence.growth(coupling, flown.notch, "adjustable", factor) for factor in (tau, 1.0)]
        for coupling in ("paper_like", "derived")
    )

    def slowest(factor: float) -> float:
        poles = Feedback.of(flown, factor).around(load_vehicle().coupled("paper_like")).poles
        return abs(complex(poles[np.argmax(poles.real)]).imag)

    return {
        "tau": tau,
        "paper_like": like[0] - like[1],
        "derived": derived[0] - derived[1],
        "unstable": int(np.count_nonzero(derived[0] > 0.0)),
        "unstable_whole": int(np.count_nonzero(derived[1] > 0.0)),
        "slowest": slowest(tau),
        "slowest_whole": slowest(1.0),
    }


def _tau() -> float:
    return float(design("adjustable").tau.min())


# Section 5.2: robust MPC, the elastic modes and the inputs in flight.


def losses(evidence: Evidence) -> dict[int, int]:
    """Return the number of vehicles lost by gain, from the last of the family to the first that loses none."""
    lost = {}
    for index in reversed(range(len(design("baseline").nominal_gains))):
        changes = () if index == FLOWN_GAIN else (("robust_mpc.gain_index", index),)
        lost[index] = int(evidence.corners(FAMILY, *changes)["diverged"].sum())
        if not lost[index]:
            break
    return lost


def rmpc_flexible(evidence: Evidence) -> Numbers:
    """Return the results of robust MPC on the coupled model, by gain."""
    family, on_cm = design("baseline"), ("vehicle.model", "CM")
    count = len(family.nominal_gains)
    gain = [("robust_mpc.gain_index", index) for index in range(count)]
    last, alone = evidence.changed(FAMILY, gain[-1], on_cm), evidence.changed(FAMILY, gain[-1])
    derived = [evidence.changed(FAMILY, one, on_cm, ("vehicle.coupling", "derived")) for one in gain]
    limits = [Feedback(family.nominal_gains[i], (), family.period).critical_coupling() for i in (0, count - 1)]
    studied = f"at least {COUPLING_SCALES[-1]:g}"
    single_limit, last_limit = (studied if kappa is None else f"{kappa:.3f}" for kappa in limits)
    return {
        "gains": count,
        "lost": sum(flight["diverged"] for flight in derived),
        "decay": last["elastic_settling_time"],
        "last_off": shown(abs(last["altitude_end_error"]), "m"),
        "last_decay": shown(last["elastic_settling_time"], "s"),
        "alone_decay": shown(alone["elastic_settling_time"], "s"),
        "single_limit": single_limit,
        "last_limit": last_limit,
        "paper_like": load_vehicle().coupling_scale("paper_like"),
    }


def rmpc_altitude(evidence: Evidence) -> Numbers:
    """Return the altitude errors at the end with the last gain and with the tube, and which gains lose vehicles."""
    count, lost = len(design("baseline").nominal_gains), losses(evidence)
    last = evidence.changed(FAMILY, ("robust_mpc.gain_index", count - 1))
    tightest, error = min(lost), abs(last["altitude_end_error"])
    if lost[tightest]:
        survival = f"that was flown, and {lost[tightest]} of {evidence.vehicles} vehicles are lost with it"
    else:
        tighter = ", ".join(f"{n} with number {index + 1}" for index, n in lost.items() if n)
        survival = f"with which none of {evidence.vehicles} vehicles is lost" + (
            f" (lost: {tighter})" if tighter else ""
        )
    return {
        "gains": count,
        "tube": shown(abs(evidence.changed("case1_tube_dm")["altitude_end_error"]), "m"),
        "tightest": tightest + 1,
        "survival": survival,
        "last": shown(error, "m"),
        "last_error": error,
        "limited": last["saturated_steps"],
    }


def rejected_paper_like(evidence: Evidence) -> Numbers:
    """Return in words the coupling at which the loop without filter becomes unstable, and how many loops are."""
    limit, scale = _critical(evidence), load_vehicle().coupling_scale("paper_like")
    return {
        "limit": "no coupling studied" if limit is None else f"{limit:.4f} times the derived coupling",
        "margin": "" if limit is None else f", {100 * (limit / scale - 1.0):.1f} % above the paper-like one",
        "unstable": int(np.count_nonzero(evidence.growth("paper_like", ()) > 0.0)),
    }


def rejected_derived(evidence: Evidence) -> Numbers:
    """Return the results with the derived coupling: flight without filter, and loops with the baseline's filter."""
    without = evidence.changed("case1_derived_no_notch")
    section, other = (design(name).notch[0] for name in ("baseline_derived", "baseline"))
    return {
        "lost": without["diverged"],
        "end": without["end_time"],
        "centre_derived": section.zero_frequency,
        "centre": other.zero_frequency,
        "unstable": int(np.count_nonzero(evidence.growth("derived", (other,)) > 0.0)),
    }


def inputs_of_case1(evidence: Evidence, scenario: str = "case1") -> Numbers:
    """Return in words the ranges of the inputs over all flights of a scenario, and the permitted ranges."""
    table, limits = evidence.corners(scenario), load_vehicle().decoupled
    ranges, permitted = [], []
    for i, (name, unit, words) in enumerate(
        (("fuel_equivalence_ratio", "1", "the fuel ratio ranges"), ("elevator_deflection", "rad", "the elevator"))
    ):
        low, high = float(table[f"{name}_minimum"].min()), float(table[f"{name}_maximum"].max())
        ranges.append(f"{words} from {shown(low, unit)} to {shown(high, unit)}")
        permitted.append(f"{shown(limits.input_minimum[i], unit)} to {shown(limits.input_maximum[i], unit)}")
    return {
        "ranges": f"{' and '.join(ranges)} over {evidence.vehicles} flights",
        "limits": f"The permitted ranges are {' and '.join(permitted)}.",
    }


def inputs_of_case2(evidence: Evidence) -> Numbers:
    """Return the same for Case 2."""
    return inputs_of_case1(evidence, "case2")

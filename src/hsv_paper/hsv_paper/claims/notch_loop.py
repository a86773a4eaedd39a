"""The loop and its flights with and without the notch filter: stability, margins, disturbances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hsv.control.notch_filter import NotchSection
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.corners import fraction
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import VehicleParameters
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence, nominal, worst
from hsv_paper.disturbances import largest_disturbances
from hsv_paper.linear_loop import TARGET, Margin, critical_coupling, phase_margins, sampled_loop, worst_growth

WITH, WITHOUT = "case1", "case1_no_notch"


def critical(evidence: Evidence) -> float | None:
    """Return the share of the derived coupling at which the baseline's loop without notch becomes unstable."""
    flown = evidence.design("baseline").flown
    return critical_coupling(flown.feedback_gain, (), flown.period, hardware=evidence.hardware)


def without_notch(evidence: Evidence) -> dict[str, Any]:
    """Return the growth (1/s) of the loops without the notch, and the coupling up to which they are stable."""
    growth, flown = evidence.growth("paper_like", ()), evidence.design("baseline").flown
    share, limit = load_vehicle().coupling_scale("paper_like"), critical(evidence)
    margin = float("inf") if limit is None else limit / share
    uncertain = assemble(flight_parameters(load_scenario("case1_uncertain_no_notch"))).plant.vehicle
    table, ringing = evidence.corners(WITHOUT), "elastic_rate_2_ringing"
    return {
        "paper_like": growth,
        "derived": evidence.growth("derived", ()),
        "uncertain": worst_growth(uncertain, flown.feedback_gain, (), flown.period, evidence.hardware),
        "margin": margin,
        "share": share,
        "limit": share * margin,
        "above": 100.0 * (margin - 1.0),
        "unstable": int(np.count_nonzero(growth > 0.0)),
        "ringing": worst(table, ringing) / nominal(table, ringing),
    }


def with_notch(evidence: Evidence) -> dict[str, Any]:
    """Return the growth (vehicles), 1/s, of the loops with the notch; ``retuned``: derived coupling, its own design."""
    notch, other = evidence.design("baseline").flown.notch, evidence.design("baseline_derived").flown.notch
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
    evidence: Evidence,
    notch: tuple[NotchSection, ...],
    vehicle: VehicleParameters | None = None,
    design: str = "baseline",
) -> list[Margin]:
    """Return the margins of the loop broken at the elevator, the slowest crossover, the rigid body's, first.

    Those of a loop that is not stable are negative. ``vehicle``: paper-like and nominal unless given.
    """
    flown = evidence.design(design).flown
    # The grid is fine near the modes, where the gain barely reaches 1.
    top = 0.95 * np.pi / flown.period
    frequencies = np.unique(np.concatenate((np.geomspace(0.1, top, 3000), np.linspace(12.0, 22.0, 5001))))
    loop = sampled_loop(
        vehicle or load_vehicle().coupled("paper_like"),
        flown.feedback_gain,
        notch,
        flown.period,
        point=TARGET,
        hardware=evidence.hardware,
    )
    sign = 1.0 if loop.growth < 0.0 else -1.0
    found = phase_margins(frequencies, loop.elevator_loop(frequencies))
    return sorted((replace(m, phase=sign * m.phase) for m in found), key=lambda margin: margin.frequency)


def _smallest(margins: list[Margin]) -> float:
    return min(margin.phase for margin in margins)


def phase_margin(evidence: Evidence) -> dict[str, Any]:
    """Return the effect (rad) of the notch on the phase margins of the loop broken at the elevator, by vehicle."""
    notch, derived = evidence.design("baseline").flown.notch, load_vehicle().coupled("derived")
    vehicles = [load_vehicle().coupled("paper_like").perturbed(corner) for corner in evidence.over]
    pairs = [(margins(evidence, (), vehicle), margins(evidence, notch, vehicle)) for vehicle in vehicles]
    gained = np.array([_smallest(after) - _smallest(before) for before, after in pairs])
    retuned = margins(evidence, evidence.design("baseline_derived").flown.notch, derived, "baseline_derived")
    before, after = pairs[0]
    return {
        "gained": gained,
        "rigid": after[0].phase - abs(before[0].phase),
        "derived": _smallest(retuned) - _smallest(margins(evidence, (), derived)),
        "smallest": np.degrees(_smallest(before)),
        "crossover": before[0].frequency,
        "crossover_after": after[0].frequency,
        "before": np.degrees(before[0].phase),
        "after": np.degrees(after[0].phase),
        "no_gain": int(np.count_nonzero(gained < 0.0)),
    }


def less_uncertainty(evidence: Evidence) -> dict[str, Any]:
    """Return the largest lumped disturbances in flight with the notch over those without, by channel."""
    over = [corner for corner in fraction(load_vehicle().uncertainty) if corner in evidence.over]
    a, b = (largest_disturbances(scenario, over) for scenario in (WITH, WITHOUT))
    reduced = ("pitch_acceleration", "acceleration", "lost_elevator")
    return {channel: a[channel].max() / b[channel].max() for channel in reduced} | {
        "pitch_nominal": a["pitch_acceleration"][0] / b["pitch_acceleration"][0],
        "flown": len(over),
    }


def closer(evidence: Evidence) -> dict[str, Any]:
    """Return the reduction (%) by the notch of errors from the nominal trajectory, nominal vehicle."""
    whole, rate = (
        nominal(evidence.corners(WITH), measure) / nominal(evidence.corners(WITHOUT), measure)
        for measure in ("rigid_error", "pitch_rate_error")
    )
    return {"closer": 100.0 * (1.0 - whole), "closer_in_rate": 100.0 * (1.0 - rate)}

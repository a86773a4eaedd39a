"""The notch filter alone and in the open loop: effect on peaks and on other frequencies, location of its zeros."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hsv.control.notch_filter import NotchSection, discretise, flown_sections, notch_response
from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.linearisation import bode, frequency_response
from hsv.model.signals import N_RIGID, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.notch_loop import margins
from hsv_paper.figures.figure_03 import POLE_DAMPINGS, POLE_FREQUENCIES
from hsv_paper.linear_loop import ELEVATOR, START
from hsv_paper.mode_peaks import FREQUENCIES, peak_falls


def _section(evidence: Evidence, design: str = "baseline") -> NotchSection:
    return evidence.design(design).flown.notch[0]


def _falls(sections: Sequence[NotchSection], coupling: str = "paper_like") -> dict[str, float]:
    return {name: fall.decibel for name, fall in peak_falls(sections, coupling).items()}


def coupling_in_pitch_rate(evidence: Evidence) -> dict[str, Any]:
    """Return the shares of the pitch rate in the effects of coupling."""
    sizes = evidence.design("baseline").certificate["inputs"]["model"]["tensor_product"]["state_scale"]
    scale = np.array(list(sizes.values()))
    (A, B), (A_alone, B_alone) = (_linearised(load_vehicle().coupled(name)) for name in ("paper_like", 0.0))
    change = ((A - A_alone) * scale / scale[:, None]) ** 2
    onto_rigid, onto_elastic = change[:N_RIGID, N_RIGID:], change[N_RIGID:, :N_RIGID]
    answer, alone = (
        frequency_response(*model, FREQUENCIES)[:, :N_RIGID, ELEVATOR] for model in ((A, B), (A_alone, B_alone))
    )
    moved = np.abs((answer - alone) / scale[:N_RIGID]) ** 2
    return {
        "onto_rigid": onto_rigid[PITCH_RATE].sum() / onto_rigid.sum(),
        "answer": moved[:, PITCH_RATE].sum() / moved.sum(),
        "onto_elastic": onto_elastic[:, PITCH_RATE].sum() / onto_elastic.sum(),
    }


def _linearised(vehicle: VehicleParameters) -> tuple[np.ndarray, np.ndarray]:
    point = trim(vehicle, *START)
    return jacobian(point.state, point.input, vehicle)


def peaks(evidence: Evidence) -> dict[str, Any]:
    """Return the reductions (dB) of both peaks, with the design's filter and with one centred at each mode."""
    section = _section(evidence)
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


def falls(evidence: Evidence) -> dict[str, Any]:
    """Return the reductions (dB) of both peaks with each coupling's filter, and the smallest with Figure 3's poles."""
    section = _section(evidence)
    changed = [replace(section, pole_frequency=w) for w in POLE_FREQUENCIES]
    changed += [replace(section, pole_damping=damping) for damping in POLE_DAMPINGS]
    derived = _falls([_section(evidence, "baseline_derived")], "derived")
    return _falls([section]) | {
        "least": min(_falls([one])["first"] for one in changed),
        "first_derived": derived["first"],
        "second_derived": derived["second"],
        "damping": section.pole_damping,
    }


def passed(evidence: Evidence) -> dict[str, Any]:
    """Return the effect of the filter off its centre: loss (dB), lag (rad), and the change of gain (dB) far off."""
    section, crossover = _section(evidence), margins(evidence, ())[0].frequency
    response = notch_response([section], np.array([1.0, crossover]))
    (slow_loss, loss), (slow_lag, lag) = -bode(response)[0], -np.angle(response)

    def change(one: NotchSection, frequency: float) -> float:
        return float(abs(bode(notch_response([one], np.array([frequency])))[0][0]))

    centre = section.zero_frequency
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


def unit_circle(evidence: Evidence) -> dict[str, Any]:
    """Return the distance of the discrete filter's zeros from the unit circle, and the gain of a deeper notch."""
    ours, period = _section(evidence), evidence.design("baseline").flown.period
    ideal = replace(ours, zero_damping=0.0)

    def distance(section: NotchSection) -> float:
        data = discretise((section,), period)
        zeros = np.linalg.eigvals(data.A[0] - np.outer(data.B[0], data.C[0]) / data.D[0])
        return float(np.abs(np.abs(zeros) - 1.0).max())

    return {
        "ideal": distance(ideal),
        "ours": distance(ours),
        "zero_damping": ours.zero_damping,
        "gained": _falls([ideal])["first"] - _falls([ours])["first"],
        "depth": -20.0 * np.log10(ours.zero_damping / ours.pole_damping),
    }

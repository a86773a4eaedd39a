"""Ranking of robust MPC and the tube controllers on the same metrics: nominal vehicle and worst corner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv_paper.claims.evidence import Evidence, nominal, worst

CONTROLLERS = {
    "RMPC, single gain (DM)": "case1_rmpc",
    "RMPC, fourth gain (DM)": "case1_rmpc_fourth_k",
    "tube without notch (CM)": "case1_no_notch",
    "tube with notch (CM)": "case1",
}

METRICS = {
    "altitude_end_error": ("altitude error at the end", "m"),
    "velocity_end_error": ("velocity error at the end", "m/s"),
    "post_fault_altitude_error": ("largest altitude error after the fault", "m"),
    "post_fault_attitude_deviation": ("attitude excursion after the fault", "rad"),
    "attitude_settling_time": ("attitude settling time", "s"),
    "elastic_decay_time": ("decay time of the elastic rates", "s"),
    "elastic_rate_2_ringing": ("peak-to-peak second elastic rate, 10 s to 20 s after the fault", "kg^0.5 m/s"),
    "altitude_integral_absolute_error": ("integral of the altitude error", "m s"),
    "elevator_deflection_maximum": ("largest elevator deflection", "rad"),
    "saturated_steps": ("steps with saturated inputs", "1"),
}
"""Name and unit by metric; smaller is better for all of them."""


@dataclass(frozen=True)
class Rank:
    """A controller on a metric (SI): value and rank for the nominal vehicle, and for the worst of all."""

    nominal: float
    worst: float
    nominal_place: int
    worst_place: int


def ranking(evidence: Evidence) -> dict[str, dict[str, Rank]]:
    """Return the ranks by metric and controller."""
    tables = {name: evidence.corners(scenario) for name, scenario in CONTROLLERS.items()}
    ranks = {}
    for metric in METRICS:
        at_nominal = {name: abs(nominal(table, metric)) for name, table in tables.items()}
        at_worst = {name: worst(table, metric) for name, table in tables.items()}
        ranks[metric] = {
            name: Rank(at_nominal[name], at_worst[name], _place(at_nominal, name), _place(at_worst, name))
            for name in tables
        }
    return ranks


def _place(values: dict[str, float], name: str) -> int:
    # Values that differ by less than a thousandth share a rank.
    return 1 + int(np.count_nonzero(np.array(list(values.values())) < values[name] * (1.0 - 1e-3)))

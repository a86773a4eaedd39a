"""The numbers of a sweep of flights: one controller over one quantity, nominal vehicle and corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsv_paper.corner_flights import Table

SweepResult = dict[str, list[float]]
"""Columns over the points of a sweep, by name."""

_METRICS = (
    "post_fault_attitude_deviation",
    "post_fault_attitude_from_nominal",
    "altitude_end_error",
    "altitude_error_maximum",
    "velocity_error_maximum",
    "elastic_decay_time",
    "altitude_settling_time",
    "velocity_settling_time",
    "fuel_equivalence_ratio_maximum",
)

SATURATED_STEPS = 50
"""Limited steps, one second, from which a flight counts as at its limits."""


def sweep_result(tables: Sequence[Table]) -> SweepResult:
    """Return the columns of one controller from the table of each point; the nominal vehicle is the first flight.

    Angles in rad, lengths in m, times in s. What a lost flight does not define is not a number, and infinite at worst.
    """
    columns: SweepResult = {"finished": [], "without_limits": [], "nominal_finished": []}
    for table in tables:
        finished = table["diverged"] == 0.0
        columns["finished"].append(float(finished.mean()))
        columns["nominal_finished"].append(float(finished[0]))
        columns["without_limits"].append(float((finished & (table["saturated_steps"] <= SATURATED_STEPS)).mean()))
    for name in _METRICS:
        rows = [np.abs(table[name]) if name in table else np.full(len(table["diverged"]), np.nan) for table in tables]
        rows = [np.where(table["diverged"] == 0.0, row, np.nan) for table, row in zip(tables, rows, strict=True)]
        columns[f"{name}_nominal"] = [float(row[0]) for row in rows]
        columns[f"{name}_worst"] = [float(np.max(row)) if not np.isnan(row).any() else np.nan for row in rows]
    return columns

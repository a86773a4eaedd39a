"""A scenario flown by many vehicles, as by those at all corners of the parameter bounds, and what was measured."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.processes import Progress
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.corners import Corner
from hsv.flight.flight import Flight
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import TubeLevels, fly_perturbed
from hsv.flight.sources import DIGITS, digest_of, flight_digest, kept, measuring_code
from hsv.model.plant import FlightStatus
from hsv_paper.measures import flight_measures

Table = dict[str, np.ndarray]
"""Columns (flights) by measure, the nominal vehicle first; what a flight does not define is not a number."""


def fly_over(
    values: dict[str, Any],
    over: Sequence[Corner],
    half_width: np.ndarray,
    progress: Callable[[int], None] = lambda done: None,
) -> Table:
    """Fly the flat parameters ``values`` with each of the vehicles in ``over``, in as many threads as processors.

    Args:
        values: Parameters of the nominal flight.
        over: Relative changes of the vehicle's parameters, one flight each.
        half_width: (5) as for :func:`hsv_paper.measures.flight_measures`.
        progress: Called with the number of flights done.
    """
    parts = assemble(values)
    levels = TubeLevels(parts)

    def job(corner: Corner, flight: Flight) -> dict[str, float]:
        data = flight.data()
        level = levels.worst(data)
        return {
            "diverged": float(flight.status is FlightStatus.DIVERGED),
            "end_time": float(data.time[-1]),
            **({} if level is None else {"tube_level": level}),
            **flight_measures(data, half_width),
        }

    rows = fly_perturbed(parts, over, job, progress)
    names = list(dict.fromkeys(name for row in rows for name in row))
    return {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}


def corner_table(
    scenario: str,
    over: Sequence[Corner],
    folder: Path,
    half_width: np.ndarray,
    progress: Progress,
    changes: Sequence[tuple[str, Any]] = (),
) -> Table:
    """Return the table of a shipped scenario over vehicles, flown once and kept.

    Args:
        scenario: Its name.
        over: Relative changes of the vehicle's parameters, one flight each.
        folder: Folder of the tables, named by a digest of what they depend on.
        half_width: (5) as above.
        progress: Called with what is done.
        changes: Flat parameters in place of the scenario's.
    """
    asked = json.dumps([list(map(dict, over)), changes]).encode()
    digest = digest_of(
        [flight_digest(scenario).encode(), half_width.tobytes(), asked, *measuring_code(__name__, "hsv_paper.measures")]
    )
    what = " ".join((scenario, *(f"{name}={value}" for name, value in changes)))
    path = folder / f"{len(over)}_vehicles_{what.replace(' ', '_')}_{digest[:DIGITS]}.npz"

    def flown() -> Table:
        progress(f"{what}, all vehicles", 0, len(over))
        values = {**flight_parameters(load_scenario(scenario)), **dict(changes)}
        return fly_over(values, over, half_width, lambda done: progress(f"{what}, all vehicles", done, len(over)))

    def save(new: Path, table: Table) -> None:
        np.savez_compressed(new, **table)  # type: ignore[arg-type]

    def load(old: Path) -> Table:
        with np.load(old) as table:
            return dict(table)

    return kept(path, flown, save, load)

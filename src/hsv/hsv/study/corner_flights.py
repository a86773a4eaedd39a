"""A scenario flown by many vehicles, as by those at all corners of the parameter bounds, and what was measured."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from hsv.campaign.tube_levels import TubeLevels
from hsv.design.region import Corner
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario
from hsv.study.measures import flight_measures
from hsv.study.sources import DIGITS, digest_of, drop_older, file_bytes, flight_digest
from hsv.vehicle.plant import FlightStatus

_MEASURING = ("study/corner_flights.py", "study/measures.py", "campaign/tube_levels.py")
"""What is measured hangs on these beside what the flight hangs on."""

Progress = Callable[[str, int, int], None]

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
        values: Of the nominal flight.
        over: Relative changes of the vehicle's parameters, one flight each.
        half_width: (5) as for :func:`hsv.study.measures.flight_measures`.
        progress: Called with the number of flights done.
    """
    levels, parts = TubeLevels(values), assemble(values)

    def job(corner: Corner) -> dict[str, float]:
        flight = fly(parts.perturbed(corner))
        data = flight.data()
        level = levels.worst(data)
        return {
            "diverged": float(flight.status is FlightStatus.DIVERGED),
            "end_time": float(data.time[-1]),
            **({} if level is None else {"tube_level": level}),
            **flight_measures(data, half_width),
        }

    rows = []
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for row in pool.map(job, over):
            rows.append(row)
            progress(len(rows))
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
        folder: Where tables are kept, under a digest of what they depend on.
        half_width: (5) as above.
        progress: Called with what is done.
        changes: Flat parameters in place of the scenario's.
    """
    asked = json.dumps([list(map(dict, over)), changes]).encode()
    modules = (file_bytes(module) for module in _MEASURING)
    digest = digest_of([flight_digest(scenario).encode(), half_width.tobytes(), asked, *modules])
    what = " ".join((scenario, *(f"{name}={value}" for name, value in changes)))
    path = folder / f"{len(over)}_vehicles_{what.replace(' ', '_')}_{digest[:DIGITS]}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return dict(kept)
    progress(f"{what}, all vehicles", 0, len(over))
    values = {**flight_parameters(load_scenario(scenario)), **dict(changes)}
    table = fly_over(values, over, half_width, lambda done: progress(f"{what}, all vehicles", done, len(over)))
    folder.mkdir(parents=True, exist_ok=True)
    new = path.with_suffix(".tmp")
    with new.open("wb") as stream:
        np.savez_compressed(stream, **table)  # type: ignore[arg-type]
    new.rename(path)
    drop_older(path)
    return table

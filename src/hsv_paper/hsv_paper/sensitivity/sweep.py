"""The flights of a sweep, stored by controller, so that an interrupted study continues where it stopped."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.processes import Progress
from hsv.flight.corners import Corner
from hsv.flight.sources import DIGITS, code_digest, digest_of, kept, measuring_code
from hsv_paper.corner_flights import fly_over
from hsv_paper.sensitivity.controllers import Controller
from hsv_paper.sensitivity.sweep_result import SweepResult, sweep_result

_HALF_WIDTH = np.ones(5)
"""The sweeps use no measure that compares errors of different rigid-body states."""


@dataclass(frozen=True)
class Point:
    """One point of a sweep: flat parameters and the vehicles flown there."""

    values: Mapping[str, Any]
    over: Sequence[Corner]


def sweep(
    name: str, along: Mapping[Controller, Sequence[Point]], folder: Path, progress: Progress
) -> dict[Controller, SweepResult]:
    """Fly every controller at its points and return the results.

    Args:
        name: Name of the study.
        along: Points by controller; the nominal vehicle is the first of each point.
        folder: Folder of the results, named by a digest of what they depend on.
        progress: Called with what is done.
    """
    total, done = sum(map(len, along.values())), 0
    results = {}
    for number, (controller, points) in enumerate(along.items()):

        def flown(points: Sequence[Point] = points, before: int = done) -> SweepResult:
            tables = []
            for index, point in enumerate(points):
                progress(f"{name}, flights", before + index, total)
                tables.append(fly_over(dict(point.values), point.over, _HALF_WIDTH))
            return sweep_result(tables)

        path = folder / f"sweep_{name}_{number}_{_digest(points)[:DIGITS]}.json"
        results[controller] = kept(path, flown, _save, _load) if controller.kept else flown()
        done += len(points)
    progress(f"{name}, flights", total, total)
    return results


def _digest(points: Sequence[Point]) -> str:
    flown = [[dict(point.values), [dict(corner) for corner in point.over]] for point in points]
    text = json.dumps(flown, sort_keys=True, default=np.ndarray.tolist)
    return digest_of(
        [
            text.encode(),
            code_digest().encode(),
            *measuring_code(sweep_result.__module__, "hsv_paper.corner_flights", "hsv_paper.measures"),
        ]
    )


def _save(path: Path, columns: SweepResult) -> None:
    path.write_text(json.dumps(columns), encoding="utf-8")


def _load(path: Path) -> SweepResult:
    columns: SweepResult = json.loads(path.read_text(encoding="utf-8"))
    return columns

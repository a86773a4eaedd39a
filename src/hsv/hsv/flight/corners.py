"""The flights of a design's region: corners of the vehicle's uncertain parameters, and random flights."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import hadamard

from hsv.model.vehicle import Vehicle

Corner = Mapping[str, float]
"""Relative changes of a vehicle's parameters, by name."""

_FRACTIONED = 10
"""Number of uncertain parameters from which :func:`fraction` returns only a quarter of the corners."""


def corners(bounds: Mapping[str, float], share: float = 1.0) -> list[dict[str, float]]:
    """Return the nominal vehicle (no changes), then all corners of ``share`` times the bounds, in a fixed order."""
    signs = itertools.product((-1.0, 1.0), repeat=len(bounds))
    return [
        {},
        *({name: s * share * bound for s, (name, bound) in zip(row, bounds.items(), strict=True)} for row in signs),
    ]


def fraction(bounds: Mapping[str, float], share: float = 1.0) -> list[dict[str, float]]:
    """Return the nominal vehicle, then a quarter of the corners of ``share`` times the ``bounds``, in a fixed order.

    With fewer than ten parameters, all corners are returned. The quarter is a regular fraction of resolution VI: the
    signs of the ninth and tenth parameters are each the product of five others. Any three parameters therefore still
    occur in all combinations of their signs.
    """
    names = list(bounds)
    nominal, *rows = corners(bounds, share)
    if len(names) < _FRACTIONED:
        return [nominal, *rows]
    signs = np.array([[np.sign(row[name]) for name in names] for row in rows])
    kept = (signs[:, 8] == signs[:, :5].prod(axis=1)) & (signs[:, 9] == signs[:, [0, 1, 5, 6, 7]].prod(axis=1))
    return [nominal, *(row for row, keep in zip(rows, kept, strict=True) if keep)]


def screening_corners(bounds: Mapping[str, float], share: float = 1.0) -> list[Corner]:
    """Return the nominal vehicle, then 32 corners of ``share`` times the ``bounds``, in a fixed order.

    The signs of the corners are the 16 rows of a Hadamard matrix and their opposites, for at most 15 parameters. Any
    three parameters occur in all combinations of their signs. With fewer than eight parameters, corners repeat.
    """
    runs = hadamard(16)[:, 1 : 1 + len(bounds)]
    rows = share * np.vstack((runs, -runs)) * np.array(list(bounds.values()))
    return [{}, *(dict(zip(bounds, map(float, row), strict=True)) for row in rows)]


class Drawn(NamedTuple):
    """A drawn flight of a design's region: parameter changes, first step of the fault and elevator effectiveness."""

    corner: Corner
    start: int
    effectiveness: float


def drawn_flights(inputs: Mapping[str, Any], vehicle: Vehicle, share: float, number: int, seed: int) -> list[Drawn]:
    """Return ``number`` random flights of the region that the ``inputs`` (SI) of a design declare.

    The fault starts in the window. Half of the flights have the largest loss of effectiveness and half a smaller one;
    half of the vehicles are corners and half lie inside the bounds. ``share`` multiplies bounds and loss (eq. 47).
    """
    random, declared, period = np.random.default_rng(seed), inputs["disturbance"], inputs["model"]["period"]
    first, last = declared["fault_window"] or [declared["fault_start"]] * 2
    names, bounds = list(vehicle.uncertainty), share * np.array(list(vehicle.uncertainty.values()))
    loss = share * (1.0 - declared["elevator_effectiveness"])
    found = []
    for start, inside, smaller in random.random((number, 3)).tolist():
        draws = random.uniform(-1.0, 1.0, len(bounds))
        changes = bounds * (draws if inside < 0.5 else np.sign(draws))
        lost = loss * (2.0 * smaller if smaller < 0.5 else 1.0)
        step = round((first + start * (last - first)) / period)
        found.append(Drawn(dict(zip(names, changes.tolist(), strict=True)), step, 1.0 - lost))
    return found

"""Corners of the uncertain parameters' bounds: relative changes of vehicle parameters, one vehicle each."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from scipy.linalg import hadamard

Corner = Mapping[str, float]
"""Relative changes of a vehicle by name of the parameter."""

_FRACTIONED = 10
"""Uncertain parameters from which on a quarter of the corners is enough to measure disturbances."""


def corners(bounds: Mapping[str, float], share: float = 1.0) -> list[dict[str, float]]:
    """Return the nominal vehicle (no change) and all corners of ``share`` of the parameter bounds, in a fixed order.

    ``bounds``: relative ones of the uncertain parameters, :attr:`hsv.model.vehicle.Vehicle.uncertainty`.
    """
    signs = itertools.product((-1.0, 1.0), repeat=len(bounds))
    return [
        {},
        *({name: s * share * bound for s, (name, bound) in zip(row, bounds.items(), strict=True)} for row in signs),
    ]


def fraction(bounds: Mapping[str, float], share: float = 1.0) -> list[dict[str, float]]:
    """Return the nominal vehicle and a quarter of the corners, in a fixed order; of fewer than ten parameters all.

    A regular fraction of resolution VI: two of ten signs are products of five others, so that every three parameters
    still meet in all their combinations.
    """
    names = list(bounds)
    nominal, *rows = corners(bounds, share)
    if len(names) < _FRACTIONED:
        return [nominal, *rows]
    signs = np.array([[np.sign(row[name]) for name in names] for row in rows])
    kept = (signs[:, 8] == signs[:, :5].prod(axis=1)) & (signs[:, 9] == signs[:, [0, 1, 5, 6, 7]].prod(axis=1))
    return [nominal, *(row for row, keep in zip(rows, kept, strict=True) if keep)]


def screening_corners(bounds: Mapping[str, float], share: float = 1.0) -> list[Corner]:
    """Return the nominal vehicle and 32 corners of ``share`` of the bounds of at most 15 parameters, in a fixed order.

    A Hadamard matrix of 16 runs and its mirror image: any three parameters meet in all their combinations.
    """
    runs = hadamard(16)[:, 1 : 1 + len(bounds)]
    rows = share * np.vstack((runs, -runs)) * np.array(list(bounds.values()))
    return [{}, *(dict(zip(bounds, map(float, row), strict=True)) for row in rows)]

"""Laws for the nominal input u_n given the nominal state x_n: interface, and nested gains (eq. 32 to eq. 35)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Any, NamedTuple, Protocol

import numpy as np

from hsv.compiled import bound, njit_in_flight
from hsv.lanes import choose, every, lanes_in, least, most
from hsv.lpv.polytope import PolytopeData

MEMBERSHIP_TOLERANCE = 1e-6
"""Relative slack of x' P x <= 1: the first deviation lies on the boundary of the outermost ellipsoid by design."""

NOT_IN_FAMILY = 255
"""Index of a gain that was found in flight."""


class NominalStatus(IntFlag):
    """Reasons for which a step of the nominal trajectory deviates from the plan; values of NominalState.status."""

    OK = 0
    OUTSIDE_FAMILY = 1
    OUTSIDE_ENVELOPE = 2
    SOLVER_FAILED = 4
    FAMILY_FALLBACK = 8


class NominalData(NamedTuple):
    """Polytope, gains K (g, 2, n) and ellipsoids P (g, s, s) for compiled functions, outermost first.

    ``interpolated``: whether the gain between two ellipsoids is one between theirs, or that of the outer one.
    """

    polytope: PolytopeData
    gains: np.ndarray
    ellipsoids: np.ndarray
    interpolated: bool


@dataclass(frozen=True)
class LawResult:
    """u_n (2); the gain K (2, 9) in it and its index in the family, ``NOT_IN_FAMILY`` if found in flight; status.

    Of an interpolated family, gain and index are those of the smallest ellipsoid that holds x_n.
    """

    input: np.ndarray
    gain: np.ndarray
    gain_index: int
    status: NominalStatus


class NominalLaw(Protocol):
    """A nominal law: deterministic, stepped once a control period."""

    compiled_with_loop: bool
    """Whether it is the nested family, whose step the compiled loop has in itself."""

    def reset(self) -> None:
        """Forget the past."""

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9), ``deviation``."""


@njit_in_flight(inline="always")
def level(ellipsoid: np.ndarray, x: Any) -> Any:
    """Return x' P x over the first states, as many as P (s, s) has rows."""
    total = 0.0
    for i in range(ellipsoid.shape[0]):
        row = 0.0
        for j in range(ellipsoid.shape[0]):
            row += ellipsoid[i, j] * x[j]
        total += x[i] * row
    return total


@njit_in_flight(error_model="numpy")
def nominal_input(data: Any, deviation: Any, u_n: Any) -> Any:
    """Write u_n = K x_n of the smallest ellipsoid around ``deviation``; return its index and whether there is one.

    Interpolated, K = a K_i + (1 - a) K_j, of that ellipsoid i and the next one inside, j, which does not hold x_n: with
    x' (a P_i + (1 - a) P_j) x = 1, a is 1 on the boundary of i and 0 on that of j, so that u_n is continuous (Wan and
    Kothare, Automatica 39, 2003). Without gains u_n is zero.
    """
    boundary = 1.0 + MEMBERSHIP_TOLERANCE
    index, held, beyond = 0.0, 0.0, 0.0
    inside = len(data.gains) == 0
    for g in range(len(data.ellipsoids) - 1, -1, -1):
        value = level(data.ellipsoids[g], deviation)
        now = choose(inside, False, value <= boundary)
        index = choose(now, g, index)
        held = choose(now, value, held)
        inside = inside | now
        if every(inside):
            break
        beyond = choose(inside, beyond, value)
    for i in range(len(u_n)):
        u_n[i] = 0.0
    first = int(least(index))
    last = first if lanes_in(index) == 1 else int(most(index))
    for g in range(first, min(last + 1, len(data.gains))):
        for i in range(len(u_n)):
            total = 0.0
            for j in range(len(deviation)):
                total += data.gains[g, i, j] * deviation[j]
            if data.interpolated and g + 1 < len(data.gains):
                share = (beyond - boundary) / (beyond - held)
                inner = 0.0
                for j in range(len(deviation)):
                    inner += data.gains[g + 1, i, j] * deviation[j]
                total = choose(inside, inner + share * (total - inner), total)
            u_n[i] = choose(index == g, total, u_n[i])
    return index, inside


class FamilyLaw:
    """The nested family: the gain of the smallest ellipsoid that holds x_n, the outermost where none does.

    Or, interpolated, one between it and that of the next ellipsoid inside.
    """

    compiled_with_loop = True

    def __init__(self, data: NominalData) -> None:
        self.data = data
        self._nominal_input = bound(nominal_input)

    def reset(self) -> None:
        """Nothing to forget."""

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9)."""
        u_n = np.empty(self.data.gains.shape[1])
        found, inside = self._nominal_input(self.data, np.ascontiguousarray(deviation, float), u_n)
        index = int(found)
        status = NominalStatus.OK if inside else NominalStatus.OUTSIDE_FAMILY
        gain = self.data.gains[index] if len(self.data.gains) else np.empty(0)
        return LawResult(u_n, gain, index, status)

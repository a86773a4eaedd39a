"""Laws for the nominal input u_n given the nominal state x_n: interface, and nested gains (eq. 32 to eq. 35)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from typing import Protocol

import numpy as np

from hsv.core import Data, doubles, ffi, lib, vector
from hsv.model.dynamics import N_STATES
from hsv.model.lpv.polytope import PolytopeData

MEMBERSHIP_TOLERANCE = 1e-6
"""Relative slack of x' P x <= 1, as in ``core/nominal.h``: the first deviation lies on the outermost boundary."""

NOT_IN_FAMILY = 255
"""Index of a gain that was found in flight."""


class NominalStatus(IntFlag):
    """Reasons for which a step of the nominal trajectory deviates from the plan; values of NominalState.status."""

    OK = 0
    OUTSIDE_FAMILY = 1
    OUTSIDE_ENVELOPE = 2
    SOLVER_FAILED = 4
    FAMILY_FALLBACK = 8


@dataclass(frozen=True, eq=False)
class NominalData(Data):
    """Polytope, gains K (g, 2, 9) and ellipsoids P (g, 5, 5) as the core takes them, outermost first.

    ``interpolated``: whether the gain between two ellipsoids is one between theirs, or that of the outer one.
    """

    KIND = "hsv_nominal"
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
    """Whether it is the nested family, which the core has in its loop."""

    def reset(self) -> None:
        """Forget the past."""

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9), ``deviation``."""


def level(ellipsoid: np.ndarray, x: np.ndarray) -> float:
    """Return x' P x over the first states, as many as P (s, s) has rows."""
    n = len(ellipsoid)
    return float(lib.hsv_level(doubles(vector(ellipsoid), n, n), n, doubles(vector(x[:n]), n)))


class FamilyLaw:
    """The nested family: the gain of the smallest ellipsoid that holds x_n, the outermost where none does.

    Or, interpolated, one between it and that of the next ellipsoid inside.
    """

    compiled_with_loop = True

    def __init__(self, data: NominalData) -> None:
        self.data = data

    def reset(self) -> None:
        """Nothing to forget."""

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9)."""
        u_n, found = np.empty(self.data.gains.shape[1]), ffi.new("double *")
        inside = lib.hsv_nominal_input(self.data.pointer, doubles(vector(deviation), N_STATES), doubles(u_n), found)
        index = int(found[0])
        status = NominalStatus.OK if inside else NominalStatus.OUTSIDE_FAMILY
        gain = self.data.gains[index] if len(self.data.gains) else np.empty(0)
        return LawResult(u_n, gain, index, status)

"""Reference equilibrium and nominal trajectory (paper eq. 20) under the nested gains of the nominal law (eq. 32-35)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag
from typing import Any, NamedTuple, Self

import numpy as np
from numba import njit

from hsv.control.design_file import ControlDesign
from hsv.lpv.polytope import PolytopeData, schedule
from hsv.parameters import Parameter, check_all
from hsv.vehicle.envelope import ALTITUDE_RANGE, VELOCITY_RANGE
from hsv.vehicle.parameters import vehicle_parameters
from hsv.vehicle.trim import Trim, trim

REFERENCE_PARAMETERS = (
    Parameter("reference.altitude", 26243.28, "commanded altitude, a step at t = 0", "m", *ALTITUDE_RANGE),
    Parameter("reference.velocity", 2484.12, "commanded velocity, a step at t = 0", "m/s", *VELOCITY_RANGE),
)

MEMBERSHIP_TOLERANCE = 1e-6
"""Relative slack of x' P x <= 1: the first deviation lies on the boundary of the outermost ellipsoid by design."""


class NominalStatus(IntFlag):
    """Why a step of the nominal trajectory is not as planned; values of NominalState.status."""

    OK = 0
    OUTSIDE_FAMILY = 1
    OUTSIDE_ENVELOPE = 2


class NominalData(NamedTuple):
    """Polytope, gains K (g, 2, n) and ellipsoids P (g, s, s) for compiled functions, outermost first."""

    polytope: PolytopeData
    gains: np.ndarray
    ellipsoids: np.ndarray


@njit(cache=True)
def level(ellipsoid: np.ndarray, x: np.ndarray) -> float:
    """Return x' P x over the first states, as many as P (s, s) has rows."""
    total = 0.0
    for i in range(ellipsoid.shape[0]):
        row = 0.0
        for j in range(ellipsoid.shape[0]):
            row += ellipsoid[i, j] * x[j]
        total += x[i] * row
    return total


@njit(cache=True)
def nominal_input(data: Any, deviation: np.ndarray, u_n: np.ndarray) -> tuple[int, bool]:
    """Write u_n = K x_n of the smallest ellipsoid that holds ``deviation``; return its index and whether there is one."""
    index = 0
    inside = False
    for g in range(len(data.ellipsoids) - 1, -1, -1):
        if level(data.ellipsoids[g], deviation) <= 1.0 + MEMBERSHIP_TOLERANCE:
            index = g
            inside = True
            break
    gain = data.gains[index]
    for i in range(gain.shape[0]):
        u_n[i] = 0.0
        for j in range(gain.shape[1]):
            u_n[i] += gain[i, j] * deviation[j]
    return index, inside


@njit(cache=True)
def nominal_advance(
    polytope: Any, altitude: float, velocity: float, deviation: np.ndarray, u_n: np.ndarray, S: np.ndarray, new: np.ndarray
) -> bool:
    """Replace ``deviation`` x_n (n) by A(p) x_n + B(p) u_n (paper eq. 20), p the measured altitude and velocity.

    ``S`` (n (n + m)) and ``new`` (n) are scratch. Returns whether p lay inside the envelope.
    """
    inside = schedule(polytope, altitude, velocity, S)
    n, m = len(deviation), len(u_n)
    for i in range(n):
        row = i * (n + m)
        total = 0.0
        for j in range(n):
            total += S[row + j] * deviation[j]
        for j in range(m):
            total += S[row + n + j] * u_n[j]
        new[i] = total
    deviation[:] = new
    return inside


@dataclass(frozen=True)
class NominalResult:
    """One step: x_r (9), u_r (2), x_n (9), u_n (2), index of the gain used (0 = outermost), status."""

    reference: np.ndarray
    reference_input: np.ndarray
    deviation: np.ndarray
    input: np.ndarray
    gain_index: int
    status: NominalStatus


class NominalTrajectory:
    """Starts at x_n(0) = x(0) - x_r(0) and runs the nominal system to the reference, scheduled by the measured state."""

    def __init__(self, design: ControlDesign, reference: Trim) -> None:
        self.reference = reference
        self.data = NominalData(design.polytope.data(), design.nominal_gains, design.nominal_ellipsoids)
        n, m = design.polytope.B.shape[1:]
        self._deviation = np.zeros(n)
        self._scratch = np.empty(n * (n + m)), np.empty(n)
        self._started = False

    @classmethod
    def from_parameters(cls, values: Mapping[str, object]) -> Self:
        """Build from the design's parameters and :data:`REFERENCE_PARAMETERS`; the design model is never perturbed.

        Raises:
            ParameterError, DesignError, TrimError: A wrong value, named.
        """
        v = check_all(REFERENCE_PARAMETERS, values)
        reference = trim(vehicle_parameters("decoupled"), v["reference.altitude"], v["reference.velocity"])
        return cls(ControlDesign.from_parameters(values), reference)

    def reset(self) -> None:
        """Forget the past: the next step starts a new nominal trajectory."""
        self._started = False

    def step(self, state: np.ndarray) -> NominalResult:
        """Return reference and nominal state of this step from the measured ``state`` (9), then advance the nominal one."""
        if not self._started:
            self._deviation[:] = state - self.reference.state
            self._started = True
        deviation = self._deviation.copy()
        u_n = np.empty(2)
        index, in_family = nominal_input(self.data, deviation, u_n)
        S, new = self._scratch
        in_envelope = nominal_advance(self.data.polytope, state[0], state[1], self._deviation, u_n, S, new)
        status = NominalStatus.OK
        if not in_family:
            status |= NominalStatus.OUTSIDE_FAMILY
        if not in_envelope:
            status |= NominalStatus.OUTSIDE_ENVELOPE
        return NominalResult(self.reference.state, self.reference.input, deviation, u_n, index, status)

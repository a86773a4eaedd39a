"""Laws for the nominal input u_n given the nominal state x_n: nested gains (eq. 32 to eq. 35), also found in flight."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.core import Struct, doubles, ffi, lib, vector
from hsv.model.signals import N_RIGID, N_STATES

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


@dataclass(frozen=True)
class LawResult:
    """u_n (2); the gain K (2, 9) in it and its index in the family, ``NOT_IN_FAMILY`` if found in flight; status.

    Of an interpolated family, gain and index are those of the smallest ellipsoid that holds x_n.
    """

    input: np.ndarray
    gain: np.ndarray
    gain_index: int
    status: NominalStatus


def level(ellipsoid: np.ndarray, x: np.ndarray) -> float:
    """Return x' P x for the first s states, with P (s, s)."""
    n = len(ellipsoid)
    return float(lib.hsv_level(doubles(vector(ellipsoid), n, n), n, doubles(vector(x[:n]), n)))


class FamilyLaw:
    """The nested family: the gain of the smallest ellipsoid with x_n, or of the outermost if x_n lies in none.

    Or, interpolated, one between it and that of the next ellipsoid inside. Other laws derive from it, and fall back to
    it; a law is deterministic and stepped once a control period.
    """

    in_core = True
    """Whether the core has the law in its loop"""

    def __init__(self, data: Struct) -> None:
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


SOLVE_STEPS = 100
"""Steps from the start of a solve to the step at which its gain takes effect."""

_HEADROOM = 1.02
"""Factor on the state that is solved for, so that the state of 100 steps later still lies in the ellipsoid."""


class KothareLaw(FamilyLaw):
    """u_n = K x_n with K from the LMI for x_n(k), in effect from step k + ``SOLVE_STEPS`` exactly.

    A worker thread solves between the steps. A step whose solution is late waits for it, so that the flight depends on
    the nominal state alone, never on timing. Until the first solution the family of gains is used. A new gain replaces
    the last one only if x_n lies in its ellipsoid, in which (35) bounds the input; otherwise, and if the solver fails,
    the last gain stays and the status reports it. It also stays inside the family's innermost ellipsoid, where a
    new gain could not improve it.
    """

    in_core = False

    def __init__(self, design: ControlDesign, data: Struct) -> None:
        super().__init__(data)
        # Modelling and solver take a second to import: only this law pays for them.
        from hsv.control.nominal_gain import NominalProblem, nominal_gain

        self._nominal_gain = nominal_gain
        polytope = design.polytope
        self._problem = NominalProblem(
            polytope.A[:, :N_RIGID, :N_RIGID],
            polytope.B[:, :N_RIGID],
            design.period,
            design.nominal_state_scale,
            design.nominal_input_scale,
            design.nominal_input_bound,
        )
        self._worker = ThreadPoolExecutor(1, "kothare")
        self._pending: Future[tuple[np.ndarray, np.ndarray] | None] | None = None
        self.reset()

    def reset(self) -> None:
        """Return to the family; a solve under way is forgotten."""
        if self._pending:
            self._pending.cancel()
        self._pending = None
        self._step = 0
        self._gain: np.ndarray | None = None
        self._status = NominalStatus.OK

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9)."""
        if self._step % SOLVE_STEPS == 0:
            if self._pending:
                self._take(self._pending.result(), deviation)
                self._pending = None
            if level(self.data.ellipsoids[-1], deviation) > 1.0:
                self._pending = self._worker.submit(self._solve, deviation[:N_RIGID].copy())
        self._step += 1
        if self._gain is None:
            result = super().step(deviation)
            return LawResult(result.input, result.gain, result.gain_index, result.status | self._status)
        return LawResult(self._gain @ deviation, self._gain, NOT_IN_FAMILY, self._status)

    def _solve(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the gain (2, 9) for a rigid state (5), and the P of its ellipsoid, or None if the solver fails."""
        try:
            found = self._nominal_gain(self._problem, _HEADROOM * state)
        except DesignError:
            return None
        gain = np.zeros(self.data.gains.shape[1:])
        gain[:, :N_RIGID] = found.K
        return gain, np.linalg.inv(found.Q)

    def _take(self, solution: tuple[np.ndarray, np.ndarray] | None, deviation: np.ndarray) -> None:
        if solution is not None and level(solution[1], deviation) <= 1.0:
            self._gain, self._status = solution[0], NominalStatus.OK
            return
        self._status = NominalStatus.SOLVER_FAILED
        if self._gain is None:
            self._status |= NominalStatus.FAMILY_FALLBACK

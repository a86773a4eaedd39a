"""The min-max LMI (paper eq. 32 to eq. 35) solved in flight at a slow rate, with the same result whatever the load."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.control.nominal_law import NOT_IN_FAMILY, FamilyLaw, LawResult, NominalData, NominalStatus, level
from hsv.control.nominal_problem import NominalProblem
from hsv.model.dynamics import N_RIGID

SOLVE_STEPS = 100
"""Steps from the start of a solve to the step at which its gain takes effect."""

_HEADROOM = 1.02
"""Factor on the state that is solved for, so that the state of 100 steps later still lies in the ellipsoid."""


@dataclass(frozen=True)
class _Solution:
    gain: np.ndarray
    ellipsoid: np.ndarray


class KothareLaw:
    """u_n = K x_n with K from the LMI for x_n(k), in effect from step k + ``SOLVE_STEPS`` exactly.

    A worker thread solves in between; where it is late, that step waits for it: the flight depends on the nominal
    state alone, never on timing. Until the first solution the family flies. A gain is taken over only if x_n then lies
    in its ellipsoid, in which (35) bounds the input; otherwise, and where the solver fails, the gain before it stays
    and the status says so. Inside the family's innermost ellipsoid the last gain stays: there is nothing left to gain.
    """

    compiled_with_loop = False

    def __init__(self, design: ControlDesign, data: NominalData) -> None:
        # Modelling and solver take a second to import: only this law pays for them.
        from hsv.control.nominal_gain import nominal_gain

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
        self._family = FamilyLaw(data)
        self._worker = ThreadPoolExecutor(1, "kothare")
        self._pending: Future[_Solution | None] | None = None
        self.reset()

    def reset(self) -> None:
        """Return to the family; a solve under way is forgotten."""
        if self._pending:
            self._pending.cancel()
        self._pending = None
        self._step = 0
        self._solution: _Solution | None = None
        self._status = NominalStatus.OK

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for x_n (9)."""
        if self._step % SOLVE_STEPS == 0:
            if self._pending:
                self._take(self._pending.result(), deviation)
                self._pending = None
            if level(self._family.data.ellipsoids[-1], deviation) > 1.0:
                self._pending = self._worker.submit(self._solve, deviation[:N_RIGID].copy())
        self._step += 1
        if self._solution is None:
            result = self._family.step(deviation)
            return LawResult(result.input, result.gain, result.gain_index, result.status | self._status)
        gain = self._solution.gain
        return LawResult(gain @ deviation, gain, NOT_IN_FAMILY, self._status)

    def _solve(self, state: np.ndarray) -> _Solution | None:
        try:
            found = self._nominal_gain(self._problem, _HEADROOM * state)
        except DesignError:
            return None
        gain = np.zeros(self._family.data.gains.shape[1:])
        gain[:, :N_RIGID] = found.K
        return _Solution(gain, np.linalg.inv(found.Q))

    def _take(self, solution: _Solution | None, deviation: np.ndarray) -> None:
        if solution is not None and level(solution.ellipsoid, deviation) <= 1.0:
            self._solution, self._status = solution, NominalStatus.OK
            return
        self._status = NominalStatus.SOLVER_FAILED
        if self._solution is None:
            self._status |= NominalStatus.FAMILY_FALLBACK

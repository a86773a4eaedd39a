"""Laws for the nominal input u_n at the nominal state x_n: nested gains (eq. 32 to eq. 35) or gains found in flight."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.core import Struct, doubles, ffi, lib, vector
from hsv.model.signals import N_RIGID, N_STATES

NOT_IN_FAMILY = 255
"""Index of a gain that does not belong to the nested family of the design."""


class NominalStatus(IntFlag):
    """Flags for irregular steps of the nominal trajectory; values of ``status`` in the message NominalState."""

    OK = 0
    OUTSIDE_FAMILY = 1
    OUTSIDE_ENVELOPE = 2
    SOLVER_FAILED = 4
    FAMILY_FALLBACK = 8


@dataclass(frozen=True)
class LawResult:
    """Result of a nominal law: u_n (2), the gain K (2, 9) used, its index in the family, and the status of the step.

    The index counts from 0, the outermost ellipsoid; ``NOT_IN_FAMILY`` marks a gain that is not of the family. In an
    interpolated family, gain and index are those of the smallest ellipsoid with x_n, but u_n is interpolated.
    """

    input: np.ndarray
    gain: np.ndarray
    gain_index: int
    status: NominalStatus


def ellipsoid_level(ellipsoid: np.ndarray, x: np.ndarray) -> float:
    """Return x' P x for the matrix P = ``ellipsoid`` (s, s) and the first s entries of ``x``; at most 1 inside."""
    n = len(ellipsoid)
    return float(lib.hsv_level(doubles(vector(ellipsoid), n, n), n, doubles(vector(x[:n]), n)))


class FamilyLaw:
    """Nominal law that uses, of the nested family, the gain of the smallest ellipsoid that contains x_n.

    If x_n lies in no ellipsoid, the gain of the outermost one is used. An interpolated family uses a gain between that
    of the smallest ellipsoid and that of the next one inside, if any. The other laws derive from this class and fall
    back to it. A law is deterministic and stepped once per control period.
    """

    in_core = True
    """Whether the C core contains the law"""

    def __init__(self, data: Struct) -> None:
        self.data = data

    def reset(self) -> None:
        """Do nothing: this law has no state."""

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for ``deviation``, the nominal state x_n (9)."""
        u_n, found = np.empty(self.data.gains.shape[1]), ffi.new("double *")
        inside = lib.hsv_nominal_input(self.data.pointer, doubles(vector(deviation), N_STATES), doubles(u_n), found)
        index = int(found[0])
        status = NominalStatus.OK if inside else NominalStatus.OUTSIDE_FAMILY
        gain = self.data.gains[index] if len(self.data.gains) else np.empty(0)
        return LawResult(u_n, gain, index, status)


SOLVE_STEPS = 100
"""Number of steps from the start of a solution to the step at which its gain takes effect."""

_HEADROOM = 1.02
"""Factor on the state for which the LMI is solved, so that the state 100 steps later still lies in the ellipsoid."""


class KothareLaw(FamilyLaw):
    """Nominal law u_n = K x_n, with a new K from eq. 32 to 35 every ``SOLVE_STEPS`` steps.

    At such a step k, a worker thread starts to solve the LMI for x_n(k), unless x_n(k) is in the innermost ellipsoid of
    the family. The gain is used from exactly step k + ``SOLVE_STEPS`` on; if it is late, this step waits for it, so
    that the flight depends on the nominal state alone, never on timing. A new gain replaces the last one only if x_n
    then lies in its ellipsoid, in which eq. 35 bounds the input. Otherwise, and if the solver fails, the last gain is
    kept and the status reports it. Before the first new gain, the family of gains is used.
    """

    in_core = False

    def __init__(self, design: ControlDesign, data: Struct) -> None:
        super().__init__(data)
        # Imported here, as the modelling tool and the solver take a second to import.
        from hsv.lmi.nominal_gain import NominalProblem, nominal_gain

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
        """Go back to the family of gains, and discard a solution that is being computed."""
        if self._pending:
            self._pending.cancel()
        self._pending = None
        self._step = 0
        self._gain: np.ndarray | None = None
        self._status = NominalStatus.OK

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for ``deviation``, the nominal state x_n (9)."""
        if self._step % SOLVE_STEPS == 0:
            if self._pending:
                self._take(self._pending.result(), deviation)
                self._pending = None
            if ellipsoid_level(self.data.ellipsoids[-1], deviation) > 1.0:
                self._pending = self._worker.submit(self._solve, deviation[:N_RIGID].copy())
        self._step += 1
        if self._gain is None:
            result = super().step(deviation)
            return LawResult(result.input, result.gain, result.gain_index, result.status | self._status)
        return LawResult(self._gain @ deviation, self._gain, NOT_IN_FAMILY, self._status)

    def _solve(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the gain (2, 9) for a rigid state (5), and P (5, 5) of its ellipsoid, or None if the solver fails."""
        try:
            found = self._nominal_gain(self._problem, _HEADROOM * state)
        except DesignError:
            return None
        gain = np.zeros(self.data.gains.shape[1:])
        gain[:, :N_RIGID] = found.K
        return gain, np.linalg.inv(found.Q)

    def _take(self, solution: tuple[np.ndarray, np.ndarray] | None, deviation: np.ndarray) -> None:
        """Use the gain of ``solution`` if x_n lies in its ellipsoid; else keep the last gain and set the status."""
        if solution is not None and ellipsoid_level(solution[1], deviation) <= 1.0:
            self._gain, self._status = solution[0], NominalStatus.OK
            return
        self._status = NominalStatus.SOLVER_FAILED
        if self._gain is None:
            self._status |= NominalStatus.FAMILY_FALLBACK

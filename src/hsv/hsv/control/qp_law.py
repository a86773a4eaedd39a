"""The nominal law u_n = K x_n + c; in every step, a quadratic programme computes c over a horizon.

The programme keeps u_n + u_r within U minus F Z and within the range of the certified plans. In the first third of the
horizon, it keeps the nominal pitch acceleration within the range of those plans, too, because the disturbance set was
measured along them. A plan bounded by U minus F Z alone causes disturbances several times as large as the set, mainly
through the filtered pitch rate.
"""

from __future__ import annotations

import numpy as np
import piqp
from scipy.linalg import solve_discrete_are

from hsv.base.errors import DesignError
from hsv.control.design import ControlDesign
from hsv.control.nominal_law import NOT_IN_FAMILY, FamilyLaw, LawResult, NominalStatus
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.core import Struct
from hsv.model.signals import N_RIGID, PITCH_RATE

BLOCKS = 30
"""Number of blocks of the horizon; c is constant in each block."""

BLOCK_TIME = 0.5
"""Duration of a block, s."""

CHECKED_NEAR, CHECKED_FAR = (0.0, 0.24, 0.48, 0.72, 0.96), (0.0, 0.48)
"""Times in near and far blocks at which bounds apply, as fractions of a block; bounds at its ends alone are too few."""

NEAR_BLOCKS = 10
"""Number of blocks at the beginning, where inputs move fast; only there is the pitch acceleration bounded."""

_ITERATIONS = 60
"""Iteration limit of the solver; about 10 are needed."""


class QpLaw(FamilyLaw):
    """Nominal law by quadratic programming over a horizon of 15 s, with model and LQR gain K at the final reference.

    With P the solution of the Riccati equation, the infinite-horizon cost is x' P x plus the sum of c' (R + B' P B) c.
    The Hessian is therefore constant, and c = 0 is optimal wherever it satisfies the bounds. The solver starts cold in
    every step, so that its solution depends on x_n alone. If the solver fails, the law continues the previous plan; if
    there is no plan or it has ended, the family of nominal gains is used.
    """

    in_core = False

    def __init__(self, design: ControlDesign, data: Struct, reference: ReferenceTrajectory) -> None:
        """Set up the programme, which keeps u_n plus every reference input of the flight within the plan bounds.

        Raises:
            DesignError: The design has no plan bounds, or a reference input lies outside them.
        """
        bounds = design.plan_bounds
        if bounds is None:
            raise DesignError("parameter nominal.input_minimum: empty, expected U minus F Z for nominal.law = 'qp'")
        inputs = reference.data.input
        if np.any(bounds.lower > inputs) or np.any(bounds.upper < inputs):
            raise DesignError(
                f"reference inputs {inputs.min(axis=0).tolist()} to {inputs.max(axis=0).tolist()}: expected inside the "
                f"plan bounds, {bounds.lower.tolist()} to {bounds.upper.tolist()}, for nominal.law = 'qp'"
            )
        super().__init__(data)
        self._lower, self._upper = bounds.lower - inputs.min(axis=0), bounds.upper - inputs.max(axis=0)
        self._scale = design.nominal_input_scale
        self._block = round(BLOCK_TIME / design.period)
        A, B = design.polytope.at(*reference.final_state[:2])
        A, B = A[:N_RIGID, :N_RIGID], B[:N_RIGID]
        Q = design.period * np.diag(1.0 / design.nominal_state_scale**2)
        R = design.period * np.diag(1.0 / self._scale**2)
        P = solve_discrete_are(A, B, Q, R)
        weight = R + B.T @ P @ B
        K = -np.linalg.solve(weight, B.T @ P @ A)
        self.gain = np.zeros(data.gains.shape[1:])
        self.gain[:, :N_RIGID] = K
        # Inputs and c are scaled by the input scales, the pitch acceleration by its range.
        low, high = bounds.pitch_acceleration
        size = np.append(self._scale, high - low)
        rate = np.append(A[PITCH_RATE] - np.eye(N_RIGID)[PITCH_RATE], B[PITCH_RATE]) / design.period
        state_map, input_map, bounded = _predicted(A + B @ K, B, K, rate, self._block)
        unit = np.tile(size, len(state_map) // len(size))
        self._state_map = (state_map / unit[:, None])[bounded]
        self._input_map = (input_map * np.tile(self._scale, BLOCKS) / unit[:, None])[bounded]
        lower, upper = np.append(self._lower, low), np.append(self._upper, high)
        self._bounds = tuple((np.resize(side, len(unit)) / unit)[bounded] for side in (lower, upper))
        scaled = self._scale[:, None] * weight * self._scale
        self._hessian = np.kron(np.eye(BLOCKS), scaled / np.max(scaled))
        self.reset()

    def reset(self) -> None:
        """Discard the current plan."""
        self._plan: np.ndarray | None = None
        self._age = 0

    def step(self, deviation: np.ndarray) -> LawResult:
        """Return the nominal input for the nominal deviation x_n (9)."""
        status = NominalStatus.OK
        plan = self._solve(deviation[:N_RIGID])
        if plan is not None:
            self._plan, self._age = plan, 0
        else:
            self._age += 1
            status = NominalStatus.SOLVER_FAILED
        block = self._age // self._block
        if self._plan is None or block >= BLOCKS:
            result = super().step(deviation)
            status |= result.status | NominalStatus.FAMILY_FALLBACK
            return LawResult(result.input, result.gain, result.gain_index, status)
        planned = self.gain @ deviation + self._plan[block]
        return LawResult(np.clip(planned, self._lower, self._upper), self.gain, NOT_IN_FAMILY, status)

    def _solve(self, state: np.ndarray) -> np.ndarray | None:
        """Return the optimal c (blocks, 2) for the rigid nominal state x_n (5), or ``None`` if the solver fails."""
        inputs = self._state_map @ state
        lower, upper = self._bounds[0] - inputs, self._bounds[1] - inputs
        if np.all(lower <= 0.0) and np.all(upper >= 0.0):
            return np.zeros((BLOCKS, len(self._scale)))
        if not np.all(np.isfinite(inputs)):
            return None
        # A new solver for each problem, as the last bits of a reused solver's result depend on earlier problems.
        solver = piqp.DenseSolver()
        solver.settings.max_iter = _ITERATIONS
        solver.setup(self._hessian, np.zeros(len(self._hessian)), None, None, self._input_map, lower, upper)
        if solver.solve() != piqp.PIQP_SOLVED:
            return None
        return np.asarray(solver.result.x).reshape(BLOCKS, -1) * self._scale


def _predicted(
    closed: np.ndarray, B: np.ndarray, K: np.ndarray, rate: np.ndarray, block: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the matrices that predict u = K x + c and the pitch acceleration over the horizon from x_n and c.

    ``closed`` is A + B K, ``rate`` (n + m) maps [x; u] to the pitch acceleration. c has m entries for each block of
    ``block`` steps.

    Returns:
        Factor of x_n (rows, n), factor of c (rows, m times blocks), and whether a row is bounded (rows). Every
        checked time has m + 1 rows: the inputs, always bounded, then the pitch acceleration, bounded only in the first
        :data:`NEAR_BLOCKS`. The times are :data:`CHECKED_NEAR` in these, :data:`CHECKED_FAR` in the other blocks.
    """
    n, m = B.shape
    power, forced = [np.eye(n)], [np.zeros((n, m))]
    for _ in range(block):
        power.append(closed @ power[-1])
        forced.append(closed @ forced[-1] + B)
    from_state, from_plan = np.eye(n), np.zeros((n, m * BLOCKS))
    state_rows, plan_rows, bounded = [], [], []
    for b in range(BLOCKS):
        mine = slice(m * b, m * (b + 1))
        for share in CHECKED_NEAR if b < NEAR_BLOCKS else CHECKED_FAR:
            step = round(share * block)
            state, plan = power[step] @ from_state, power[step] @ from_plan
            plan[:, mine] += forced[step]
            inputs = K @ plan
            inputs[:, mine] += np.eye(m)
            state_rows += [K @ state, ((rate[:n] + rate[n:] @ K) @ state)[None]]
            plan_rows += [inputs, (rate[:n] @ plan + rate[n:] @ inputs)[None]]
            bounded += [True] * m + [b < NEAR_BLOCKS]
        from_state, from_plan = power[block] @ from_state, power[block] @ from_plan
        from_plan[:, mine] += forced[block]
    return np.vstack(state_rows), np.vstack(plan_rows), np.array(bounded)

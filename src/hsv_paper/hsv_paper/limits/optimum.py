"""Optimal control of the simulated vehicle by sequential quadratic programming, with inputs held over periods.

The unknowns are the inputs and the states at the ends of all periods (multiple shooting): in a single trajectory, an
unstable vehicle would amplify every change of an early input. The integrator of the flights is linearised by the
complex step. Each iteration solves a convex programme. Its cost has the positive part of the Lagrangian's curvature, a
proximal term, and an exact penalty on defects of the dynamics (Nocedal and Wright, Numerical Optimization, 2nd ed.,
section 18.5). If the curvature of the dynamics spoils a step, a second-order correction follows (section 18.3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from hsv.base.errors import DesignError
from hsv.model.dynamics import VehicleParameters, derivative, jacobian, transitions
from hsv.model.signals import N_INPUTS, N_STATES

STATE_SCALE = np.array([100.0, 50.0, 0.03, 0.03, 0.05, 1.0, 10.0, 1.0, 10.0])
"""Typical changes of the nine states, in SI units."""

INPUT_SCALE = np.array([0.5, 0.2])
"""Typical changes of the fuel equivalence ratio and the elevator deflection (rad)."""

DEFECT = 1e-7
"""Largest defect of an optimum, relative to :data:`STATE_SCALE`: a hundredth of a millimetre of altitude."""

_PENALTY = 30.0
_ITERATIONS = 400
_SIZE = N_STATES + N_INPUTS + 1


@dataclass(frozen=True)
class Point:
    """A first guess, an iterate or an optimum: the scalar s, the states (N + 1, 9) and the inputs (N, 2).

    multipliers: The costates, shape (N, 9): sensitivities of the cost to the scaled defects of each period.
    """

    scalar: float
    state: np.ndarray
    input: np.ndarray
    multipliers: np.ndarray

    def finer(self, factor: int) -> Point:
        """Return the point with ``factor`` times the periods: states interpolated, inputs and multipliers repeated."""
        n = len(self.input)
        fine = np.arange(n * factor + 1) / factor
        state = np.stack([np.interp(fine, np.arange(n + 1), column) for column in self.state.T], axis=1)
        return Point(self.scalar, state, *(np.repeat(each, factor, 0) for each in (self.input, self.multipliers)))


@dataclass(frozen=True)
class Problem:
    """Minimisation of a scalar s. Unknowns: s, the states at the ends of N periods, the inputs held over each period.

    Args:
        period, period_slope: The lengths of the periods in seconds are period + s period_slope, shape (N,).
        substeps: Number of Runge-Kutta steps of each period, shape (N,).
        inputs, inputs_slope: The bounds of the inputs are inputs + s inputs_slope, shape (2, N, 2), lower ones first.
        states: Bounds of the states, shape (2, N + 1, 9), lower ones first. Equal bounds fix a state or an input.
        at_rest: Whether the last state must be an equilibrium with the last input.
        scalar: Range of s.
        cost: Weight of s against the defects, which are relative to :data:`STATE_SCALE`.
    """

    vehicle: VehicleParameters
    period: np.ndarray
    period_slope: np.ndarray
    substeps: np.ndarray
    inputs: np.ndarray
    inputs_slope: np.ndarray
    states: np.ndarray
    at_rest: bool
    scalar: tuple[float, float]
    cost: float = 1.0

    def periods(self, scalar: float) -> np.ndarray:
        """Return the lengths in seconds of the N periods for a value of the scalar."""
        return np.asarray(self.period + scalar * self.period_slope)

    def times(self, scalar: float) -> np.ndarray:
        """Return the times in seconds of the N + 1 states for a value of the scalar."""
        return np.concatenate(([0.0], np.cumsum(self.periods(scalar))))

    def defects(self, point: Point) -> np.ndarray:
        """Return the 9 N scaled defects of the dynamics, followed, if ``at_rest``, by the 9 scaled final rates."""
        end, _ = self.transitions(point)
        missing = [(end - point.state[1:]) / STATE_SCALE]
        if self.at_rest:
            missing.append(derivative(point.state[-1], point.input[-1], self.vehicle)[None] / STATE_SCALE)
        return np.vstack(missing).ravel()

    def transitions(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (N, 9) at the ends of periods; their derivatives (N, 9, 12) by state, input and length."""
        return transitions(point.state[:-1], point.input, self.periods(point.scalar), self.substeps, self.vehicle)

    def merit(self, point: Point) -> float:
        """Return the cost plus the exact penalty on the defects."""
        return self.cost * point.scalar + _PENALTY * float(np.abs(self.defects(point)).sum())

    def solve(self, first: Point, tolerance: float = 1e-6) -> Point:
        """Return the local optimum that the iteration reaches from ``first``.

        It has converged when two successive steps promise to reduce the merit by less than ``tolerance``, and the
        defects are below :data:`DEFECT`.

        Raises:
            DesignError: The iteration does not converge, or the solver fails.
        """
        # The merit has no penalty on bounds, because all steps keep to them. The first point must keep to them, too.
        inputs = np.clip(first.input, *(self.inputs + first.scalar * self.inputs_slope))
        point = replace(first, state=np.clip(first.state, *self.states), input=inputs)
        weight, merit, settled = 1e-2, self.merit(point), 0
        for _ in range(_ITERATIONS):
            local = _Local(self, point)
            promises = []
            while True:
                trial, promise = local.step(weight)
                promises.append(promise)
                value = self.merit(trial)
                if merit - value < 0.75 * promise:
                    corrected, _ = local.step(weight, self.defects(trial))
                    if (other := self.merit(corrected)) < value:
                        trial, value = corrected, other
                gain = merit - value
                if gain >= 0.1 * promise or promise < 1e-3 * tolerance:
                    break
                weight *= 4.0
            if gain > 0.7 * promise:
                weight = max(weight / 5.0, 1e-7)
            elif gain < 0.25 * promise:
                weight *= 2.0
            if gain > 0.0:
                point, merit = trial, value
            settled = settled + 1 if promises[0] < tolerance else 0
            missing = float(np.abs(self.defects(point)).max())
            if settled >= 2 and missing < DEFECT:
                return point
        raise DesignError(
            f"optimal control: after {_ITERATIONS} iterations the largest defect is {missing:.1e}, "
            f"expected {DEFECT:g}, and a step promises {promises[0]:.1e}, expected {tolerance:g}"
        )


def curvatures(
    state: np.ndarray,
    inputs: np.ndarray,
    period: np.ndarray,
    substeps: np.ndarray,
    vehicle: VehicleParameters,
    weights: np.ndarray,
) -> np.ndarray:
    """Return the second derivatives, shape (N, 12, 12), of the weighted sums of N periods' final states.

    The ``weights`` have shape (N, 9). The derivatives are by initial states, inputs and period length, as differences
    of complex steps; those by elastic states are left zero.
    """
    reach = {0: 1.0, 1: 1.0, 2: 1e-4, 3: 1e-4, 4: 1e-4, 9: 1e-3, 10: 1e-3, 11: 1e-5}
    curved = list(reach)
    point = np.column_stack((state, inputs, period))
    half = np.zeros((len(point), _SIZE, _SIZE))
    for a, distance in reach.items():
        gradients = []
        for sign in (1.0, -1.0):
            moved = point.copy()
            moved[:, a] += sign * distance
            parts = moved[:, :N_STATES], moved[:, N_STATES:-1], moved[:, -1]
            gradients.append(np.einsum("ki,kij->kj", weights, transitions(*parts, substeps, vehicle)[1]))
        half[:, a, curved] = ((gradients[0] - gradients[1]) / (4.0 * distance))[:, curved]
    return half + half.swapaxes(1, 2)


class _Local:
    """The convex programme about a point, for scaled changes of states 1 to N, of the inputs and of s.

    Each equation adds two unknowns, the slacks: its positive and its negative residual.
    """

    def __init__(self, problem: Problem, point: Point) -> None:
        self._problem, self._point = problem, point
        self._found = np.zeros(0)  # solution of the last step without correction
        n = len(point.input)
        self._states, self._moved = n * N_STATES, n * (N_STATES + N_INPUTS) + 1
        k = np.arange(n)[:, None]
        # Column of each state, input and s (N, 12) in each period. The first state is fixed: its columns are negative.
        state, inputs = N_STATES * (k - 1) + np.arange(N_STATES), self._states + N_INPUTS * k + np.arange(N_INPUTS)
        unknown = np.hstack((state, inputs, np.full((n, 1), self._moved - 1)))
        free = unknown >= 0
        entries = np.ones(free.sum()), (np.flatnonzero(free), unknown[free])
        moved = sparse.csr_matrix(entries, (unknown.size, self._moved))
        scale = np.tile(np.concatenate((STATE_SCALE, INPUT_SCALE, [1.0])), (n, 1))
        scale[:, -1] = problem.period_slope
        end, slope = problem.transitions(point)
        equations = [
            _blocks(slope * scale[:, None, :] / STATE_SCALE[:, None]) @ moved - sparse.eye(self._states, self._moved)
        ]
        right = [((point.state[1:] - end) / STATE_SCALE).ravel()]
        if problem.at_rest:
            rates = derivative(point.state[-1], point.input[-1], problem.vehicle)
            last = np.hstack(jacobian(point.state[-1], point.input[-1], problem.vehicle))
            at = [*range(self._states - N_STATES, self._states), *unknown[-1, N_STATES:-1]]
            equations.append((last * scale[-1, :-1] / STATE_SCALE[:, None]) @ sparse.eye(self._moved, format="csr")[at])
            right.append(-rates / STATE_SCALE)
        self._right = np.concatenate(right)
        slack = sparse.eye(len(self._right))
        self._equations = sparse.hstack((sparse.vstack(equations), slack, -slack), format="csr")
        # The curvature of the Lagrangian, without the negative eigenvalues of each period's block.
        weights = point.multipliers / STATE_SCALE
        lengths = problem.periods(point.scalar)
        curved = curvatures(point.state[:-1], point.input, lengths, problem.substeps, problem.vehicle, weights)
        values, vectors = np.linalg.eigh(curved * scale[:, :, None] * scale[:, None, :])
        curved = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
        self._curvature = moved.T @ _blocks(curved) @ moved
        self._bound()

    def _bound(self) -> None:
        """Write equations and bounds as rows of one matrix; for z, lower <= z - slope (change of s) <= upper."""
        problem, point, n, size = self._problem, self._point, len(self._point.input), self._equations.shape[1]
        sizes = np.concatenate((np.tile(STATE_SCALE, n), np.tile(INPUT_SCALE, n), [1.0]))
        value = np.concatenate((point.state[1:].ravel(), point.input.ravel(), [point.scalar]))
        no_slope = np.zeros(self._states)
        slopes = [np.concatenate((no_slope, side.ravel(), [0.0])) / sizes for side in problem.inputs_slope]
        bounds = [
            (np.concatenate((states[1:].ravel(), inputs.ravel(), [scalar])) - value) / sizes
            for states, inputs, scalar in zip(
                problem.states, problem.inputs + point.scalar * problem.inputs_slope, problem.scalar, strict=True
            )
        ]
        given = (bounds[0] == bounds[1]) & (slopes[0] == slopes[1])
        unknowns = sparse.eye(size, format="csr")
        below = []
        for sign, slope, room in zip((-1.0, 1.0), slopes, bounds, strict=True):
            by_scalar = sparse.csr_matrix(slope[:, None]) @ unknowns[self._moved - 1]
            rows, use = sign * (unknowns[: self._moved] - by_scalar), np.isfinite(room) & ~given
            below.append((rows[use], sign * room[use]))
        below.append((-unknowns[self._moved :], np.zeros(size - self._moved)))
        self._given = room[given]
        self._room = np.concatenate([limit for _, limit in below])
        self._matrix = sparse.vstack([self._equations, rows[given], *(part for part, _ in below)], format="csc")

    def step(self, weight: float, missed: np.ndarray | None = None) -> tuple[Point, float]:
        """Return the next point for a proximal ``weight``, and the predicted decrease of the merit.

        ``missed``: The defects after the last step with this weight, to correct that step for them; None: a new step.

        Raises:
            DesignError: The solver fails.
        """
        import clarabel  # of the extra "design"

        m, moved, point, right = len(self._right), self._moved, self._point, self._right
        if missed is not None:
            found = self._found
            right = self._equations @ found - missed - (found[moved : moved + m] - found[moved + m :])
        proximal = np.append(np.full(moved - 1, weight / len(point.input)), 0.0)
        quadratic = sparse.triu(self._curvature + sparse.diags(proximal))
        cost = np.concatenate((np.zeros(moved - 1), [self._problem.cost], np.full(2 * m, _PENALTY)))
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        cones = [clarabel.ZeroConeT(m + len(self._given)), clarabel.NonnegativeConeT(len(self._room))]
        bound = np.concatenate((right, self._given, self._room))
        padded = sparse.block_diag((quadratic, sparse.csc_matrix((2 * m, 2 * m))), format="csc")
        solution = clarabel.DefaultSolver(padded, cost, self._matrix, bound, cones, settings).solve()
        z = np.array(solution.x)
        if not np.isfinite(z).all():
            raise DesignError(f"optimal control: the solver ended with {solution.status}")
        if missed is None:
            self._found = z
        state = point.state.copy()
        state[1:] += z[: self._states].reshape(-1, N_STATES) * STATE_SCALE
        inputs = point.input + z[self._states : moved - 1].reshape(-1, N_INPUTS) * INPUT_SCALE
        multipliers = np.array(solution.z)[: self._states].reshape(-1, N_STATES)
        promise = _PENALTY * (np.abs(self._right).sum() - z[moved:].sum())
        promise -= self._problem.cost * z[moved - 1] + 0.5 * z[:moved] @ (self._curvature @ z[:moved])
        return Point(point.scalar + z[moved - 1], state, inputs, multipliers), float(promise)


def _blocks(blocks: np.ndarray) -> sparse.bsr_matrix:
    """Return the block-diagonal matrix of ``blocks`` (N, rows, columns)."""
    n = len(blocks)
    return sparse.bsr_matrix((blocks, np.arange(n), np.arange(n + 1)))

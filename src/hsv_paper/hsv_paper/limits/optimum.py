"""Optimal control of the vehicle as flown, inputs held over periods, by sequential quadratic programming.

The states at all ends of periods are unknowns next to the inputs (multiple shooting): a single trajectory of an
unstable vehicle would amplify every change of an early input. What is linearised is the integrator of the flights, by
the complex step. Each iteration solves a convex programme with the curvature of the Lagrangian as far as it is convex,
a proximal term, and an exact penalty on what is missing in the dynamics (Nocedal and Wright, Numerical Optimization,
2nd ed., section 18.5); where the curvature of the dynamics spoils a step, a second-order correction follows (section
18.3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from hsv.base.errors import DesignError
from hsv.model.dynamics import VehicleParameters, derivative, jacobian, transitions
from hsv.model.signals import N_INPUTS, N_STATES

STATE_SCALE = np.array([100.0, 50.0, 0.03, 0.03, 0.05, 1.0, 10.0, 1.0, 10.0])
"""Typical changes of the states, SI."""

INPUT_SCALE = np.array([0.5, 0.2])
"""Typical changes of fuel equivalence ratio and elevator (rad)."""

DEFECT = 1e-7
"""Largest defect of an optimum, in :data:`STATE_SCALE`: a hundredth of a millimetre of altitude."""

_PENALTY = 30.0
_ITERATIONS = 400
_SIZE = N_STATES + N_INPUTS + 1


@dataclass(frozen=True)
class Point:
    """Scalar s, states (N + 1, 9) and inputs (N, 2): a first guess, an iterate or an optimum.

    multipliers: (N, 9) sensitivity of the cost to the states' equations, scaled; the costates.
    """

    scalar: float
    state: np.ndarray
    input: np.ndarray
    multipliers: np.ndarray

    @classmethod
    def guess(cls, scalar: float, state: np.ndarray, inputs: np.ndarray) -> Point:
        """Return a first guess; ``state`` (N + 1, 9), ``inputs`` (N, 2)."""
        return cls(scalar, state, inputs, np.zeros((len(inputs), N_STATES)))

    def finer(self, factor: int) -> Point:
        """Return the point on a mesh with each period divided in ``factor``: states interpolated, inputs repeated."""
        n = len(self.input)
        fine = np.arange(n * factor + 1) / factor
        state = np.stack([np.interp(fine, np.arange(n + 1), column) for column in self.state.T], axis=1)
        return Point(self.scalar, state, *(np.repeat(each, factor, 0) for each in (self.input, self.multipliers)))


@dataclass(frozen=True)
class Problem:
    """Least scalar s, over s, the states before and after each of N periods, and the inputs held over them.

    vehicle: Parameters.
    period, period_slope: (N) each: a period lasts period + s period_slope (s).
    substeps: (N) Runge-Kutta steps of each.
    inputs, inputs_slope: (2, N, 2) lower and upper bounds of the inputs: inputs + s inputs_slope; equal: given.
    states: (2, N + 1, 9) bounds of the states; where both agree, as at the beginning, the state is given.
    at_rest: The last state is an equilibrium with the last input.
    scalar: Range of s.
    cost: Weight of s: by this factor a unit of s counts as much as the defects, in :data:`STATE_SCALE`.
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
        """Return the lengths (N) of the periods for a value of s."""
        return np.asarray(self.period + scalar * self.period_slope)

    def defects(self, point: Point) -> np.ndarray:
        """Return the scaled defects of the dynamics (9 N) and, for a final trim, of rest at the end (9 more)."""
        end, _ = self.transitions(point)
        missing = [(end - point.state[1:]) / STATE_SCALE]
        if self.at_rest:
            missing.append(derivative(point.state[-1], point.input[-1], self.vehicle)[None] / STATE_SCALE)
        return np.vstack(missing).ravel()

    def transitions(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (N, 9) after all periods, and their derivatives (N, 9, 12)."""
        return transitions(point.state[:-1], point.input, self.periods(point.scalar), self.substeps, self.vehicle)

    def merit(self, point: Point) -> float:
        """Return the cost with the exact penalty on defects."""
        return self.cost * point.scalar + _PENALTY * float(np.abs(self.defects(point)).sum())

    def solve(self, first: Point, tolerance: float = 1e-6) -> Point:
        """Return the local optimum reached from the guess ``first``: no step promises more than ``tolerance`` of cost.

        Raises:
            DesignError: The iteration ends elsewhere.
        """
        # Steps keep to the bounds, so that the merit is of the dynamics alone: the first point must, too.
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
    """Return second derivatives (N, 12, 12) of the states after N periods, summed with ``weights`` (N, 9).

    By state, input and length of the period: complex steps, differenced. The elastic states enter linearly: zero.
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
    """The convex programme about a point; unknowns: changes of states 1 to N, of inputs and of s, scaled; slacks.

    Slacks, two for each equation, are what is missing of it, above and below.
    """

    def __init__(self, problem: Problem, point: Point) -> None:
        self._problem, self._point = problem, point
        self._found = np.zeros(0)  # of the last step that was not corrected
        n = len(point.input)
        self._states, self._moved = n * N_STATES, n * (N_STATES + N_INPUTS) + 1
        end, slope = problem.transitions(point)
        scale = np.concatenate((STATE_SCALE, INPUT_SCALE, [1.0]))
        slope = slope * scale / STATE_SCALE[:, None]
        slope[:, :, -1] *= problem.period_slope[:, None]
        # The unknown (N, 12) of each state, input and s in each period; -1: the given first state.
        k = np.arange(n)[:, None]
        state = N_STATES * (k - 1) + np.arange(N_STATES)
        state[0] = -1
        inputs = self._states + N_INPUTS * k + np.arange(N_INPUTS)
        columns = np.hstack((state, inputs, np.full((n, 1), self._moved - 1)))
        rows = np.broadcast_to(np.arange(self._states).reshape(n, N_STATES, 1), slope.shape)
        into = np.broadcast_to(columns[:, None, :], slope.shape)
        moving, own = into >= 0, np.arange(self._states)
        entries = [(slope[moving], rows[moving], into[moving]), (-np.ones(self._states), own, own)]
        right = [((point.state[1:] - end) / STATE_SCALE).ravel()]
        if problem.at_rest:
            rates = derivative(point.state[-1], point.input[-1], problem.vehicle)
            last = np.hstack(jacobian(point.state[-1], point.input[-1], problem.vehicle))
            where = np.concatenate((np.arange(N_STATES) - N_STATES + self._states, columns[-1, N_STATES:-1]))
            row = np.repeat(self._states + np.arange(N_STATES), len(where))
            entries.append(((last * scale[:-1] / STATE_SCALE[:, None]).ravel(), row, np.tile(where, N_STATES)))
            right.append(-rates / STATE_SCALE)
        self._right = np.concatenate(right)
        m = len(self._right)
        self._size = self._moved + 2 * m
        entries += [(sign * np.ones(m), np.arange(m), first + np.arange(m)) for sign, first in self._slacks(m)]
        value, row, column = (np.concatenate(of) for of in zip(*entries, strict=True))
        self._equations = sparse.csr_matrix((value, (row, column)), (m, self._size))
        self._curvature = self._convex(columns, scale)
        self._bound(scale)

    def _slacks(self, m: int) -> tuple[tuple[float, int], tuple[float, int]]:
        return (1.0, self._moved), (-1.0, self._moved + m)

    def _convex(self, columns: np.ndarray, scale: np.ndarray) -> sparse.csc_matrix:
        """Return the curvature of the Lagrangian, each period's without its negative eigenvalues; the upper half."""
        problem, point = self._problem, self._point
        period, weights = problem.periods(point.scalar), point.multipliers / STATE_SCALE
        blocks = curvatures(point.state[:-1], point.input, period, problem.substeps, problem.vehicle, weights)
        scale = np.tile(scale, (len(period), 1))
        scale[:, -1] = problem.period_slope
        values, vectors = np.linalg.eigh(blocks * scale[:, :, None] * scale[:, None, :])
        blocks = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
        i, j = np.broadcast_arrays(columns[:, :, None], columns[:, None, :])
        upper = (i >= 0) & (i <= j)
        return sparse.csc_matrix((blocks[upper], (i[upper], j[upper])), (self._size, self._size))

    def _bound(self, scale: np.ndarray) -> None:
        """Write the equations and the bounds of the problem as rows of the unknowns: lower <= z - slope ds <= upper."""
        problem, point, n = self._problem, self._point, len(self._point.input)
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
        unknowns = sparse.eye(self._size, format="csr")
        equal, below = [], []
        for sign, slope, room in zip((-1.0, 1.0), slopes, bounds, strict=True):
            by_scalar = sparse.csr_matrix(slope[:, None]) @ unknowns[self._moved - 1]
            rows, use = sign * (unknowns[: self._moved] - by_scalar), np.isfinite(room) & ~given
            below.append((rows[use], sign * room[use]))
        equal = [(rows[given], room[given])]
        below.append((-unknowns[self._moved :], np.zeros(self._size - self._moved)))
        self._given = np.concatenate([room for _, room in equal])
        self._room = np.concatenate([room for _, room in below])
        self._matrix = sparse.vstack([self._equations, *(rows for rows, _ in (*equal, *below))], format="csc")

    def step(self, weight: float, missed: np.ndarray | None = None) -> tuple[Point, float]:
        """Return the next point with a proximal ``weight``, and by how much the merit should fall.

        ``missed``: the defects after the last step, which had the same weight; it is corrected for them.

        Raises:
            DesignError: The solver fails.
        """
        import clarabel  # of the extra "design"

        m, moved, point, right = len(self._right), self._moved, self._point, self._right
        if missed is not None:
            found = self._found
            right = self._equations @ found - missed - (found[moved : moved + m] - found[moved + m :])
        proximal, cost = np.zeros(self._size), np.zeros(self._size)
        proximal[: moved - 1] = weight / len(point.input)
        cost[moved - 1], cost[moved:] = self._problem.cost, _PENALTY
        quadratic = sparse.csc_matrix(sparse.diags(proximal) + self._curvature)
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
        cones = [clarabel.ZeroConeT(m + len(self._given)), clarabel.NonnegativeConeT(len(self._room))]
        bound = np.concatenate((right, self._given, self._room))
        solution = clarabel.DefaultSolver(quadratic, cost, self._matrix, bound, cones, settings).solve()
        z = np.array(solution.x)
        if not np.isfinite(z).all():
            raise DesignError(f"optimal control: the solver ended with {solution.status}")
        if missed is None:
            self._found = z
        state = point.state.copy()
        state[1:] += z[: self._states].reshape(-1, N_STATES) * STATE_SCALE
        inputs = point.input + z[self._states : moved - 1].reshape(-1, N_INPUTS) * INPUT_SCALE
        multipliers = np.array(solution.z)[: self._states].reshape(-1, N_STATES)
        bent = z @ (self._curvature @ z) - 0.5 * (z**2 @ self._curvature.diagonal())
        promise = _PENALTY * (np.abs(self._right).sum() - z[moved:].sum())
        promise -= self._problem.cost * z[moved - 1] + bent
        return Point(point.scalar + z[moved - 1], state, inputs, multipliers), float(promise)

"""Optimal control of the vehicle as flown, inputs held over periods, by sequential quadratic programming.

The states at all ends of periods are unknowns beside the inputs (multiple shooting): a single trajectory of an unstable
vehicle would amplify every change of an early input. What is linearised is the integrator of the flights, by the
complex step. Each iteration solves a convex programme with the curvature of the Lagrangian as far as it is convex, a
proximal term, and an exact penalty on what is missing in the dynamics (Nocedal and Wright, Numerical Optimization, 2nd
ed., section 18.5); where the curvature of the dynamics spoils a step, a second-order correction follows (section 18.3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse

from hsv.base.errors import DesignError
from hsv.core import doubles, ffi, lib, vector
from hsv.model.dynamics import VehicleParameters, derivative, jacobian, vehicle_struct
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
_STEP = 1e-40  # of hsv_transitions


@dataclass(frozen=True)
class Bounds:
    """Bounds of the inputs of N periods (N, 2) each: low + s low_slope and high + s high_slope; equal: given."""

    low: np.ndarray
    high: np.ndarray
    low_slope: np.ndarray
    high_slope: np.ndarray

    def at(self, scalar: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper bounds for a value of s."""
        return self.low + scalar * self.low_slope, self.high + scalar * self.high_slope


@dataclass(frozen=True)
class Problem:
    """Least scalar s, over s, the states before and after each of N periods, and the inputs held over them.

    vehicle: Parameters.
    period, period_slope: (N) each: a period lasts period + s period_slope (s).
    substeps: (N) Runge-Kutta steps of each.
    inputs: Bounds of the inputs.
    state_low, state_high: (N + 1, 9) bounds of the states; where both agree, as at the beginning, the state is given.
    at_rest: The last state is an equilibrium with the last input.
    scalar: Range of s.
    cost: Weight of s: by this factor a unit of s counts as much as the defects, in :data:`STATE_SCALE`.
    """

    vehicle: VehicleParameters
    period: np.ndarray
    period_slope: np.ndarray
    substeps: np.ndarray
    inputs: Bounds
    state_low: np.ndarray
    state_high: np.ndarray
    at_rest: bool
    scalar: tuple[float, float]
    cost: float = 1.0

    def periods(self, scalar: float) -> np.ndarray:
        """Return the lengths (N) of the periods for a value of s."""
        return self.period + scalar * self.period_slope


@dataclass(frozen=True)
class Point:
    """Scalar s, states (N + 1, 9) and inputs (N, 2): a first guess, an iterate or an optimum.

    multipliers: (N, 9) sensitivity of the cost to the states' equations, scaled; the costates.
    """

    scalar: float
    state: np.ndarray
    input: np.ndarray
    multipliers: np.ndarray


def guess(scalar: float, state: np.ndarray, inputs: np.ndarray) -> Point:
    """Return a first guess; ``state`` (N + 1, 9), ``inputs`` (N, 2)."""
    return Point(scalar, state, inputs, np.zeros((len(inputs), N_STATES)))


def finer(point: Point, factor: int) -> Point:
    """Return the point on a mesh with each period divided in ``factor``: states interpolated, inputs repeated."""
    n = len(point.input)
    fine = np.arange(n * factor + 1) / factor
    state = np.stack([np.interp(fine, np.arange(n + 1), column) for column in point.state.T], axis=1)
    return Point(point.scalar, state, np.repeat(point.input, factor, 0), np.repeat(point.multipliers, factor, 0))


def transitions(
    state: np.ndarray, inputs: np.ndarray, period: np.ndarray, substeps: np.ndarray, vehicle: VehicleParameters
) -> tuple[np.ndarray, np.ndarray]:
    """Return the states (N, 9) after N periods from ``state`` (N, 9), and their derivatives (N, 9, 12).

    These are by state, input and length of the period (s), by the complex step: exact.
    """
    end, changes = _complex_steps(state, inputs, period, substeps, vehicle)
    return end, changes / _STEP


def _complex_steps(
    state: np.ndarray, inputs: np.ndarray, period: np.ndarray, substeps: np.ndarray, vehicle: VehicleParameters
) -> tuple[np.ndarray, np.ndarray]:
    """Return what :func:`transitions` does, the derivatives times the complex step."""
    end, changes = np.empty((len(period), N_STATES)), np.empty((len(period), N_STATES, _SIZE))
    lib.hsv_transitions(
        len(period),
        *(doubles(vector(each)) for each in (state, inputs, period)),
        ffi.from_buffer("int64_t[]", np.ascontiguousarray(substeps, np.int64)),
        vehicle_struct(vehicle).pointer,
        *map(doubles, (end, changes)),
    )
    return end, changes


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
            _, changes = _complex_steps(*parts, substeps, vehicle)
            gradient = np.zeros((len(point), _SIZE))
            for i in range(N_STATES):
                gradient += weights[:, i, None] * changes[:, i]
            gradients.append(gradient / _STEP)
        half[:, a, curved] = ((gradients[0] - gradients[1]) / (4.0 * distance))[:, curved]
    return half + half.swapaxes(1, 2)


def defects(problem: Problem, point: Point) -> np.ndarray:
    """Return what the states miss of the dynamics (9 N), and at the end of rest (9 more then), scaled."""
    period = problem.periods(point.scalar)
    end, _ = transitions(point.state[:-1], point.input, period, problem.substeps, problem.vehicle)
    missing = [(end - point.state[1:]) / STATE_SCALE]
    if problem.at_rest:
        missing.append(derivative(point.state[-1], point.input[-1], problem.vehicle)[None] / STATE_SCALE)
    return np.vstack(missing).ravel()


def solve(
    problem: Problem,
    first: Point,
    tolerance: float = 1e-6,
) -> Point:
    """Return the local optimum reached from the guess ``first``: no step promises more than ``tolerance`` of cost.

    Raises:
        DesignError: The iteration ends elsewhere.
    """
    # Steps keep to the bounds, so that the merit is of the dynamics alone: the first point must, too.
    state = np.clip(first.state, problem.state_low, problem.state_high)
    point = replace(first, state=state, input=np.clip(first.input, *problem.inputs.at(first.scalar)))
    weight, merit, settled = 1e-2, _merit(problem, point), 0
    for _ in range(_ITERATIONS):
        local = _Local(problem, point)
        promises = []
        while True:
            trial, promise = local.step(weight)
            promises.append(promise)
            value = _merit(problem, trial)
            if merit - value < 0.75 * promise:
                corrected, _ = local.step(weight, defects(problem, trial))
                if (other := _merit(problem, corrected)) < value:
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
        missing = float(np.abs(defects(problem, point)).max())
        if settled >= 2 and missing < DEFECT:
            break
    else:
        raise DesignError(
            f"optimal control: after {_ITERATIONS} iterations the largest defect is {missing:.1e}, "
            f"expected {DEFECT:g}, and a step promises {promises[0]:.1e}, expected {tolerance:g}"
        )
    return point


def _merit(problem: Problem, point: Point) -> float:
    return problem.cost * point.scalar + _PENALTY * float(np.abs(defects(problem, point)).sum())


class _Local:
    """The convex programme about a point; unknowns: changes of states 1 to N, of inputs and of s, scaled; slacks.

    Slacks, two for each equation, are what is missing of it, above and below.
    """

    def __init__(self, problem: Problem, point: Point) -> None:
        self._problem, self._point = problem, point
        self._found = np.zeros(0)  # of the last step that was not corrected
        n = len(point.input)
        self._states, self._inputs = n * N_STATES, n * N_INPUTS
        self._moved = self._states + self._inputs + 1
        period = problem.periods(point.scalar)
        end, slope = transitions(point.state[:-1], point.input, period, problem.substeps, problem.vehicle)
        self._scale = np.concatenate((STATE_SCALE, INPUT_SCALE, [1.0]))
        slope = slope * self._scale / STATE_SCALE[:, None]
        slope[:, :, -1] *= problem.period_slope[:, None]
        columns = self._columns(n)
        rows = np.broadcast_to(np.arange(self._states).reshape(n, N_STATES, 1), slope.shape)
        into = np.broadcast_to(columns[:, None, :], slope.shape)
        moving = into >= 0
        entries = [(slope[moving], rows[moving], into[moving])]
        entries.append((-np.ones(self._states), np.arange(self._states), np.arange(self._states)))
        right = [((point.state[1:] - end) / STATE_SCALE).ravel()]
        if problem.at_rest:
            rates = derivative(point.state[-1], point.input[-1], problem.vehicle)
            by_state, by_input = jacobian(point.state[-1], point.input[-1], problem.vehicle)
            last = np.hstack((by_state, by_input)) * self._scale[:-1] / STATE_SCALE[:, None]
            where = np.concatenate((np.arange(N_STATES) - N_STATES + self._states, columns[-1, N_STATES:-1]))
            row = self._states + np.arange(N_STATES)
            entries.append((last.ravel(), np.repeat(row, len(where)), np.tile(where, N_STATES)))
            right.append(-rates / STATE_SCALE)
        self._right = np.concatenate(right)
        m = len(self._right)
        self._size = self._moved + 2 * m
        for sign in (0, 1):
            slacks = self._moved + sign * m + np.arange(m)
            entries.append((np.full(m, 1.0 - 2.0 * sign), np.arange(m), slacks))
        value, row, column = (np.concatenate(of) for of in zip(*entries, strict=True))
        self._equations = sparse.csr_matrix((value, (row, column)), (m, self._size))
        self._curvature = self._convex(period, columns)
        self._bound()

    def _columns(self, n: int) -> np.ndarray:
        """Return the unknown (N, 12) of each state, input and s in each period; -1: the given first state."""
        k = np.arange(n)[:, None]
        state = N_STATES * (k - 1) + np.arange(N_STATES)
        state[0] = -1
        return np.hstack((state, self._states + N_INPUTS * k + np.arange(N_INPUTS), np.full((n, 1), self._moved - 1)))

    def _convex(self, period: np.ndarray, columns: np.ndarray) -> Any:
        """Return the curvature of the Lagrangian, each period's without its negative eigenvalues; the upper half."""
        problem, point = self._problem, self._point
        weights = point.multipliers / STATE_SCALE
        blocks = curvatures(point.state[:-1], point.input, period, problem.substeps, problem.vehicle, weights)
        scale = np.tile(self._scale, (len(period), 1))
        scale[:, -1] = problem.period_slope
        values, vectors = np.linalg.eigh(blocks * scale[:, :, None] * scale[:, None, :])
        blocks = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
        i = np.broadcast_to(columns[:, :, None], blocks.shape)
        j = np.broadcast_to(columns[:, None, :], blocks.shape)
        upper = (i >= 0) & (i <= j)
        return sparse.csc_matrix((blocks[upper], (i[upper], j[upper])), (self._size, self._size))

    def _bound(self) -> None:
        """Write what is given and what is bounded as rows of the unknowns."""
        problem, point = self._problem, self._point
        s = point.scalar
        equal, below = [], []
        index = np.arange(self._states)
        low, high = (
            ((side - point.state) / STATE_SCALE)[1:].ravel() for side in (problem.state_low, problem.state_high)
        )
        given = low == high
        equal.append((self._rows(index[given], 1.0), low[given]))
        for sign, room in ((1.0, high), (-1.0, -low)):
            use = np.isfinite(room) & ~given
            below.append((self._rows(index[use], sign), room[use]))
        b = problem.inputs
        index = self._states + np.arange(self._inputs)
        given = ((b.low == b.high) & (b.low_slope == b.high_slope)).ravel()
        for sign, value, slope in ((1.0, b.high, b.high_slope), (-1.0, b.low, b.low_slope)):
            room = sign * ((value + s * slope - point.input) / INPUT_SCALE).ravel()
            rows = self._rows(index, sign, -sign * (slope / INPUT_SCALE).ravel())
            below.append((rows[~given], room[~given]))
            if sign > 0.0:
                equal.append((rows[given], room[given]))
        last = np.array([self._moved - 1])
        below.append((self._rows(last, 1.0), np.array([problem.scalar[1] - s])))
        below.append((self._rows(last, -1.0), np.array([s - problem.scalar[0]])))
        slacks = np.arange(self._moved, self._size)
        below.append((self._rows(slacks, -1.0), np.zeros(len(slacks))))
        self._given = np.concatenate([room for _, room in equal])
        self._room = np.concatenate([room for _, room in below])
        rows = [self._equations, *(rows for rows, _ in (*equal, *below))]
        self._matrix = sparse.vstack(rows, format="csc")

    def _rows(self, index: np.ndarray, sign: float, by_scalar: np.ndarray | None = None) -> Any:
        """Return rows with ``sign`` at the unknowns ``index`` and ``by_scalar`` at s."""
        count = np.arange(len(index))
        rows = sparse.csr_matrix((np.full(len(index), sign), (count, index)), (len(index), self._size))
        if by_scalar is None:
            return rows
        where = np.full(len(index), self._moved - 1)
        return rows + sparse.csr_matrix((by_scalar, (count, where)), (len(index), self._size))

    def step(self, weight: float, missed: np.ndarray | None = None) -> tuple[Point, float]:
        """Return the next point with a proximal ``weight``, and by how much the merit should fall.

        ``missed``: the defects after the last step, which had the same weight; it is corrected for them.

        Raises:
            DesignError: The solver fails.
        """
        import clarabel  # of the extra "design"

        m = len(self._right)
        right = self._right
        if missed is not None:
            found = self._found
            slack = found[self._moved : self._moved + m] - found[self._moved + m :]
            right = self._equations @ found - missed - slack
        proximal = np.zeros(self._size)
        proximal[: self._moved - 1] = weight / len(self._point.input)
        quadratic = sparse.csc_matrix(sparse.diags(proximal) + self._curvature)
        cost = np.zeros(self._size)
        cost[self._moved - 1], cost[self._moved :] = self._problem.cost, _PENALTY
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
        point, n = self._point, len(self._point.input)
        state = point.state.copy()
        state[1:] += z[: self._states].reshape(n, N_STATES) * STATE_SCALE
        inputs = point.input + z[self._states : self._moved - 1].reshape(n, N_INPUTS) * INPUT_SCALE
        multipliers = np.array(solution.z)[: self._states].reshape(n, N_STATES)
        bent = z @ (self._curvature @ z) - 0.5 * (z**2 @ self._curvature.diagonal())
        promise = _PENALTY * (np.abs(self._right).sum() - z[self._moved :].sum())
        promise -= self._problem.cost * z[self._moved - 1] + bent
        return Point(point.scalar + z[self._moved - 1], state, inputs, multipliers), float(promise)

import numpy as np
import pytest

from hsv.core.arithmetic import solve


@pytest.mark.parametrize("n", [1, 2, 3, 9, 40])
def test_solution_satisfies_the_equations_to_rounding(n):
    rng = np.random.default_rng(n)
    A, b = rng.normal(size=(n, n)), rng.normal(size=(n, 2))
    X = solve(A, b)
    # Elimination with pivoting is backward stable: the residual is rounding of |A| |X|, n times.
    assert np.all(np.abs(A @ X - b) <= 4 * n * np.finfo(float).eps * (np.abs(A) @ np.abs(X) + np.abs(b)))


def test_pivots_are_chosen_and_arguments_left_alone():
    A, b = np.array([[0.0, 2.0], [4.0, 1.0]]), np.array([[2.0], [9.0]])
    before = A.copy(), b.copy()
    assert solve(A, b).tolist() == [[2.0], [1.0]]
    assert np.array_equal(A, before[0])
    assert np.array_equal(b, before[1])


@pytest.mark.parametrize("A", [np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 4.0]]), np.full((2, 2), np.nan)])
def test_singular_equations_have_no_finite_solution(A):
    assert not np.all(np.isfinite(solve(A, np.ones((2, 1)))))

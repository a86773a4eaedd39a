"""Elementary functions, linear equations and random numbers compared with published values."""

import math

import mpmath
import numpy as np
import pytest
from core_calls import philox, sine_cosine

from hsv.core import lib
from hsv.core.arithmetic import arcsine, exponential, logarithm, solve, tangent

ANGLE_RANGE, EXPONENT_RANGE, RATIO_RANGE = 1e5, 700.0, 1e140

rng = np.random.default_rng(20070508)
COUNT = 1500


def sine(x):
    return sine_cosine(x)[0]


def cosine(x):
    return sine_cosine(x)[1]


def both_signs(values):
    return np.concatenate((values, -values))


def magnitudes(low, high, count=COUNT):
    """Return positive numbers whose logarithms are evenly distributed."""
    return 10.0 ** rng.uniform(math.log10(low), math.log10(high), count)


def near(points, relative=1e-9):
    """Return numbers near ``points``, including the points themselves and their floating-point neighbours."""
    points = np.asarray(points, float)
    noise = points * (1.0 + relative * rng.uniform(-1.0, 1.0, len(points)))
    return np.concatenate((points, noise, np.nextafter(points, -np.inf), np.nextafter(points, np.inf)))


TINY = both_signs(magnitudes(1e-300, 1.0, 200))
QUARTERS = near(np.arange(1, 60000, 97) * (math.pi / 4))
ANGLES = np.r_[rng.uniform(-10, 10, 3 * COUNT), rng.uniform(-ANGLE_RANGE, ANGLE_RANGE, COUNT), TINY, QUARTERS, 0.0, 1e5]
ENDS = both_signs(1.0 - magnitudes(1e-16, 0.1, 200))
SINES = np.r_[rng.uniform(-1.0, 1.0, 2 * COUNT), TINY, ENDS, 0.0, near([0.5, -0.5]), 1.0, -1.0]
STEPS = near(np.arange(1, 1000) * (math.log(2.0) / 2.0))
EXPONENTS = np.r_[
    rng.uniform(-1, 1, COUNT), rng.uniform(-EXPONENT_RANGE, EXPONENT_RANGE, COUNT), TINY, STEPS, 0.0, 700.0
]
ABOUT_ONE = 1.0 + both_signs(magnitudes(1e-16, 0.3, 400))
POWERS = near(2.0 ** np.arange(-1000.0, 1000.0, 7.0), 1e-3)
POSITIVE = np.r_[rng.uniform(0.5, 2.0, COUNT), magnitudes(1e-307, 1e308), ABOUT_ONE, POWERS, np.finfo(float).tiny, 1.0]


def largest_error(function, exact, arguments):
    """Return the largest error, in units of the exact value's last place, and the argument where it occurs."""
    worst = 0.0, None
    with mpmath.workprec(160):
        for argument in arguments:
            given = np.atleast_1d(argument).tolist()
            value = exact(*map(mpmath.mpf, given))
            unit = max(math.ulp(float(value)), 5e-324)
            error = float(abs(mpmath.mpf(float(function(*given))) - value) / unit)
            worst = max(worst, (error, given), key=lambda pair: pair[0])
    return worst


@pytest.mark.parametrize(
    ("function", "exact", "arguments"),
    [
        (sine, mpmath.sin, ANGLES),
        (cosine, mpmath.cos, ANGLES),
        (tangent, mpmath.tan, ANGLES),
        (arcsine, mpmath.asin, SINES),
        (exponential, mpmath.exp, EXPONENTS),
        (logarithm, mpmath.log, POSITIVE),
    ],
)
def test_error_is_at_most_one_unit_in_the_last_place(function, exact, arguments):
    error, where = largest_error(function, exact, arguments)
    assert error <= 1.0, where


def test_error_of_the_arctangent_is_at_most_one_unit_in_the_last_place():
    angle = rng.uniform(-math.pi, math.pi, 2 * COUNT)
    radius = magnitudes(1e-100, 1e100, 2 * COUNT)
    eighths = near(np.tan(np.pi / 8 * np.array([1, 2, 3])), 1e-12)
    points = [*zip(radius * np.sin(angle), radius * np.cos(angle), strict=True)]
    points += [*zip(magnitudes(1e-9, 1e9), both_signs(magnitudes(1e-9, 1e9)), strict=False)]
    points += [(sign * y, x) for y in eighths for x in (1.0, -1.0) for sign in (1.0, -1.0)]
    points += [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 0.0), (RATIO_RANGE, -1.0 / RATIO_RANGE)]
    error, where = largest_error(
        lib.hsv_arctangent2, lambda y, x: mpmath.atan2(y, x) if y or x else mpmath.mpf(0), points
    )
    assert error <= 1.0, where


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (sine, (1.1 * ANGLE_RANGE, -1e300, math.inf, math.nan)),
        (cosine, (1.1 * ANGLE_RANGE, -1e300, math.inf, math.nan)),
        (tangent, (1.1 * ANGLE_RANGE, -1e300, math.inf, math.nan)),
        (arcsine, (1.0000000000000002, -2.0, math.inf, math.nan)),
        (exponential, (701.0, -701.0, math.inf, -math.inf, math.nan)),
        (logarithm, (0.0, -1.0, 1e-310, math.inf, math.nan)),
    ],
)
def test_what_is_out_of_range_gives_no_number(function, arguments):
    assert all(math.isnan(function(argument)) for argument in arguments)


@pytest.mark.parametrize("point", [(1e141, 1.0), (1.0, 1e-141), (math.inf, 1.0), (1.0, math.nan)])
def test_points_out_of_range_give_no_angle(point):
    assert math.isnan(lib.hsv_arctangent2(*point))


@pytest.mark.parametrize("n", [1, 2, 3, 9, 40])
def test_solution_satisfies_the_equations_to_rounding(n):
    rng = np.random.default_rng(n)
    A, b = rng.normal(size=(n, n)), rng.normal(size=(n, 2))
    X = solve(A, b)
    # Elimination with pivoting is backward stable: the residual is about n roundings of |A| |X|.
    assert np.all(np.abs(A @ X - b) <= 4 * n * np.finfo(float).eps * (np.abs(A) @ np.abs(X) + np.abs(b)))


@pytest.mark.parametrize("A", [np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 4.0]]), np.full((2, 2), np.nan)])
def test_singular_equations_have_no_finite_solution(A):
    assert not np.all(np.isfinite(solve(A, np.ones((2, 1)))))


def words(text):
    return tuple(int(word, 16) for word in text.split())


@pytest.mark.parametrize(
    ("counter_and_key", "expected"),
    [
        ("0 0 0 0 0 0", "16554d9eca36314c db20fe9d672d0fdc d7e772cee186176b 7e68b68aec7ba23b"),
        ("ffffffffffffffff " * 6, "87b092c3013fe90b 438c3c67be8d0224 9cc7d7c69cd777b6 a09caebf594f0ba0"),
    ],
)
def test_known_answers_of_the_authors(counter_and_key, expected):
    # From kat_vectors of Random123, the library of the generator's authors.
    given = words(counter_and_key)
    assert philox(given[:4], given[4:]) == words(expected)

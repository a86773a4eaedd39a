"""Elementary functions that give the same bits on every processor, compiled.

The functions of libm and of numpy differ between machines in their last bit: other variants are chosen where the
processor can multiply and add in one rounding. Those here are made of additions, subtractions, multiplications,
divisions and square roots alone, each rounded once as IEEE 754 demands, in the order in which they are written. Their
error is at most one unit in the last place (ulp) in the ranges stated; outside them the result is not a number.

:func:`sine_cosine` and :func:`exponential` also take a complex argument whose imaginary part is so small (1e-20 at
most) that its square vanishes: the result is then the value and, as its imaginary part, the derivative times that of
the argument, which is what the complex step needs. Both take lanes, too (:mod:`hsv.lanes`).
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.lanes import choose, every, lane, lanes_in, power_of_two, with_lane

ANGLE_RANGE = 1e5
"""Largest magnitude (rad) of an argument of sine, cosine and tangent."""

EXPONENT_RANGE = 700.0
"""Largest magnitude of an argument of the exponential."""

RATIO_RANGE = 1e140
"""Largest magnitude of an argument of the arctangent; the least, but for zero, is its inverse."""

_HALF_PI_1 = 1.5707963267341256
"""The first 33 bits of pi / 2: its products with whole numbers below 2^20 are exact."""
_HALF_PI_2 = 6.077100506303966e-11
"""The next 33 bits of pi / 2."""
_HALF_PI_3 = 2.0222662487959506e-21
"""Remainder of pi / 2."""
_HALF_PI_HIGH, _HALF_PI_LOW = 1.5707963267948966, 6.123233995736766e-17
"""pi / 2 as the sum of two numbers."""
_QUARTER_PI_HIGH, _QUARTER_PI_LOW = 0.7853981633974483, 3.061616997868383e-17
"""pi / 4 as the sum of two numbers."""
_TWO_OVER_PI = 0.6366197723675814
_LOG_2_HIGH = 0.6931471803691238
"""The first 32 bits of the logarithm of 2: its products with exponents are exact."""
_LOG_2_LOW = 1.9082149292705877e-10
_LOG_2_INVERSE = 1.4426950408889634
_SQUARE_ROOT_HALF = 0.7071067811865476
_TAN_PI_8, _TAN_3_PI_8 = 0.41421356237309503, 2.414213562373095
_TO_WHOLE = 1.5 * 2.0**52
"""Added and subtracted again, it rounds a number below 2^51 to the nearest whole one."""
_SPLIT = 2.0**27 + 1.0
"""Factor that splits a number in two of 26 bits each (Dekker 1971)."""

# Coefficients of the power series; each quotient of integers is rounded correctly.
_S3, _S5, _S7, _S9, _S11, _S13, _S15, _S17 = ((-1) ** k / factorial(2 * k + 1) for k in range(1, 9))
_C4, _C6, _C8, _C10, _C12, _C14, _C16, _C18 = ((-1) ** k / factorial(2 * k) for k in range(2, 10))
_E2, _E3, _E4, _E5, _E6, _E7, _E8, _E9, _E10, _E11, _E12, _E13 = (1 / factorial(k) for k in range(2, 14))
_LOGARITHM = tuple(1 / (2 * k + 1) for k in range(1, 13))
_ARCTANGENT = tuple((-1) ** k / (2 * k + 1) for k in range(1, 23))
_ARCSINE = tuple(factorial(2 * k) / (4**k * factorial(k) * factorial(k) * (2 * k + 1)) for k in range(1, 26))


@njit_in_flight()
def _two_sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b as its rounded value and the rounding error (Knuth)."""
    total = a + b
    shadow = total - a
    return total, (a - (total - shadow)) + (b - shadow)


@njit_in_flight()
def _two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b as its rounded value and the rounding error (Dekker 1971)."""
    product = a * b
    scaled = _SPLIT * a
    a_high = scaled - (scaled - a)
    a_low = a - a_high
    scaled = _SPLIT * b
    b_high = scaled - (scaled - b)
    b_low = b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@njit_in_flight()
def _quotient(high: float, low: float, by_high: float, by_low: float) -> tuple[float, float]:
    """Return (high + low) / (by_high + by_low) as the sum of two numbers."""
    quotient = high / by_high
    product, error = _two_product(quotient, by_high)
    return quotient, (((high - product) - error) + low - quotient * by_low) / by_high


@njit_in_flight()
def _polynomial(coefficients: Any, z: float) -> float:
    total = 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        total = total * z + coefficients[k]
    return total


@njit_in_flight()
def _reduced(x: float) -> tuple[int, float, float]:
    """Return n and y as the sum of two numbers, with x = n pi / 2 + y and |y| at most about pi / 4."""
    whole = (x * _TWO_OVER_PI + _TO_WHOLE) - _TO_WHOLE
    high, low = _two_sum(x - whole * _HALF_PI_1, -whole * _HALF_PI_2)
    low -= whole * _HALF_PI_3
    y = high + low
    return int(whole), y, (high - y) + low


@njit_in_flight()
def _sine_terms(y: float) -> tuple[float, float]:
    """Return sin y, |y| at most pi / 4, as the sum of y and another number; the series is summed in pairs."""
    z = y * y
    w = z * z
    v = w * w
    series = ((_S3 + z * _S5) + w * (_S7 + z * _S9)) + v * ((_S11 + z * _S13) + w * (_S15 + z * _S17))
    return y, z * y * series


@njit_in_flight()
def _cosine_terms(y: float) -> tuple[float, float]:
    """Return cos y, |y| at most pi / 4, as the sum of 1 - y^2 / 2 and another number."""
    z = y * y
    w = z * z
    v = w * w
    series = ((_C4 + z * _C6) + w * (_C8 + z * _C10)) + v * ((_C12 + z * _C14) + w * (_C16 + z * _C18))
    half = 0.5 * z
    high = 1.0 - half
    return high, ((1.0 - high) - half) + w * series


@njit_in_flight()
def _turned_terms(x: float) -> tuple[float, float, float, float]:
    """Return sin x and cos x, each as the sum of two numbers, for any |x| up to 1e5."""
    turns, y, rest = _reduced(x)
    s, s_low = _sine_terms(y)
    c, c_low = _cosine_terms(y)
    _, error = _two_product(y, y)  # of the square in both series
    s_low, c_low = s_low + (rest * (c + c_low) + _S3 * y * error), c_low - (rest * (s + s_low) + 0.5 * error)
    if turns & 1:
        s, s_low, c, c_low = c, c_low, -s, -s_low
    if turns & 2:
        s, s_low, c, c_low = -s, -s_low, -c, -c_low
    return s, s_low, c, c_low


@njit_in_flight()
def _any_sine_cosine(x: float) -> tuple[float, float]:
    if not abs(x) <= ANGLE_RANGE:
        return np.nan, np.nan
    s, s_low, c, c_low = _turned_terms(x)
    return s + s_low, c + c_low


@njit_in_flight()
def _small_sine_cosine(x: float) -> tuple[float, float]:
    s, s_low = _sine_terms(x)
    c, c_low = _cosine_terms(x)
    return s + s_low, c + c_low


@njit_in_flight()
def _lane_by_lane(x: Any) -> Any:
    sin, cos = x, x
    for i in range(lanes_in(x)):
        own = lane(x, i)
        s, c = _small_sine_cosine(own) if abs(own) <= _QUARTER_PI_HIGH else _any_sine_cosine(own)
        sin, cos = with_lane(sin, i, s), with_lane(cos, i, c)
    return sin, cos


@njit_in_flight()
def sine_cosine(x: Any) -> Any:
    """Return the sine and the cosine of ``x`` (rad), real with |x| up to 1e5, or complex as the module says."""
    a = x.real
    if every(abs(a) <= _QUARTER_PI_HIGH):
        sin, cos = _small_sine_cosine(a)
    elif lanes_in(a) == 1:
        sin, cos = _any_sine_cosine(lane(a, 0))
    else:
        sin, cos = _lane_by_lane(a)
    step = x - a  # zero where x is real
    return sin + cos * step, cos - sin * step


@njit_in_flight()
def sine(x: float) -> float:
    """Return the sine of ``x`` (rad), real, up to 1e5 in magnitude."""
    return sine_cosine(x)[0]


@njit_in_flight()
def cosine(x: float) -> float:
    """Return the cosine of ``x`` (rad), real, up to 1e5 in magnitude."""
    return sine_cosine(x)[1]


@njit_in_flight()
def tangent(x: float) -> float:
    """Return the tangent of ``x`` (rad), real, up to 1e5 in magnitude."""
    if not abs(x) <= ANGLE_RANGE:
        return np.nan
    s, s_low, c, c_low = _turned_terms(x)
    s, s_low = _two_sum(s, s_low)
    c, c_low = _two_sum(c, c_low)
    high, low = _quotient(s, s_low, c, c_low)
    return high + low


@njit_in_flight()
def arcsine(x: float) -> float:
    """Return the angle (rad) from -pi / 2 to pi / 2 whose sine is ``x``, from -1 to 1."""
    a = abs(x)
    if not a <= 1.0:
        return np.nan
    if a <= 0.5:
        z = a * a
        angle = a + a * z * _polynomial(_ARCSINE, z)
    else:
        # arcsin a = pi / 2 - 2 arcsin r with r^2 = (1 - a) / 2; the root with the error that its rounding left.
        z = 0.5 * (1.0 - a)
        root = np.sqrt(z)
        product, error = _two_product(root, root)
        rest = ((z - product) - error) / (2.0 * root) if root > 0.0 else 0.0
        rest += root * z * _polynomial(_ARCSINE, z)
        high, low = _two_sum(_HALF_PI_HIGH, -2.0 * root)
        angle = high + (low + (_HALF_PI_LOW - 2.0 * rest))
    return -angle if x < 0.0 else angle


@njit_in_flight()
def arctangent2(y: float, x: float) -> float:
    """Return the angle (rad) from -pi to pi of the point (``x``, ``y``); each zero or of magnitude 1e-140 to 1e140.

    The angle of (0, 0) is 0; the sign of a zero does not count.
    """
    a, b = abs(y), abs(x)
    for side in (a, b):
        if not (side == 0.0 or 1.0 / RATIO_RANGE <= side <= RATIO_RANGE):
            return np.nan
    if a == 0.0:
        return 0.0 if x >= 0.0 else 2.0 * _HALF_PI_HIGH
    # The angle of (b, a) is a multiple of pi / 4 and that of another point, whose tangent is at most tan(pi / 8).
    if a <= _TAN_PI_8 * b:
        base, base_low = 0.0, 0.0
        high, low = _quotient(a, 0.0, b, 0.0)
    elif a < _TAN_3_PI_8 * b:
        base, base_low = _QUARTER_PI_HIGH, _QUARTER_PI_LOW
        difference, difference_low = _two_sum(a, -b)
        total, total_low = _two_sum(a, b)
        high, low = _quotient(difference, difference_low, total, total_low)
    else:
        base, base_low = _HALF_PI_HIGH, _HALF_PI_LOW
        high, low = _quotient(-b, 0.0, a, 0.0)
    z = high * high
    low = high * z * _polynomial(_ARCTANGENT, z) + low / (1.0 + z)
    if x < 0.0:
        base, base_low = 2.0 * _HALF_PI_HIGH - base, 2.0 * _HALF_PI_LOW - base_low
        high, low = -high, -low
    total, rest = _two_sum(base, high)
    angle = total + (rest + (low + base_low))
    return -angle if y < 0.0 else angle


@njit_in_flight()
def _exponential(x: Any) -> Any:
    whole = (x * _LOG_2_INVERSE + _TO_WHOLE) - _TO_WHOLE
    high, low = x - whole * _LOG_2_HIGH, whole * _LOG_2_LOW
    r = high - low
    rest = (high - r) - low
    z = r * r
    w = z * z
    v = w * w
    series = ((_E2 + r * _E3) + z * (_E4 + r * _E5)) + w * ((_E6 + r * _E7) + z * (_E8 + r * _E9))
    series += v * ((_E10 + r * _E11) + z * (_E12 + r * _E13))
    return (1.0 + (r + (z * series + rest))) * power_of_two(whole)


@njit_in_flight()
def exponential(x: Any) -> Any:
    """Return e to the power ``x``, real with |x| up to 700, or complex as the module says."""
    a = x.real
    inside = abs(a) <= EXPONENT_RANGE
    value = _exponential(a) if every(inside) else choose(inside, _exponential(choose(inside, a, 0.0)), np.nan)
    return value * (1.0 + (x - a))  # the last factor is one where x is real


@njit_in_flight()
def logarithm(x: float) -> float:
    """Return the natural logarithm of ``x``, a normal positive number."""
    if not np.finfo(np.float64).tiny <= x <= np.finfo(np.float64).max:
        return np.nan
    exponent = int(np.float64(x).view(np.int64) >> 52) - 1023
    # In two factors: 2^1023 has no inverse among the normal numbers.
    half = exponent >> 1
    mantissa = x * power_of_two(-half) * power_of_two(half - exponent)
    if mantissa > 2.0 * _SQUARE_ROOT_HALF:
        mantissa *= 0.5
        exponent += 1
    # log m = 2 artanh s = f - s (f - 2 s^2 (1/3 + s^2/5 + ...)) with f = m - 1 and s = f / (2 + f), f exact.
    f = mantissa - 1.0
    s = f / (2.0 + f)
    z = s * s
    half_square = 0.5 * f * f
    correction = s * (half_square + 2.0 * z * _polynomial(_LOGARITHM, z))
    count = float(exponent)
    return count * _LOG_2_HIGH - ((half_square - (correction + count * _LOG_2_LOW)) - f)

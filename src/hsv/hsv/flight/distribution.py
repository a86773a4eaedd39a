"""Distributions that replace numbers in a scenario, and from which a campaign draws.

In a file: ``{ uniform = ["-5 deg", "5 deg"] }``, least and largest value, or ``{ normal = ["0 ft", "10 ft"] }``, mean
and standard deviation. A normal distribution is truncated at three standard deviations, so that the extreme values can
be checked before the first flight of a campaign. Drawn values have the same bits on every processor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.base.errors import QuantityError
from hsv.base.units import parse_quantity, rounded
from hsv.core.arithmetic import exponential, logarithm, of_each

KINDS = {"uniform": "[least, largest]", "normal": "[mean, standard deviation]", "grid": "[value, value, ...]"}
"""Kinds of distributions by their key in a file, each with the meaning of its values. A grid is not drawn but swept."""

TRUNCATION = 3.0
"""Number of standard deviations from the mean to each end of a truncated normal distribution."""

_BELOW = 0.0013498980316300946
"""Probability that a normal variable is more than three standard deviations below its mean."""

# Coefficients of the numerator and the denominator of a normal distribution's quantile, of the highest power first
# (Wichura 1988, algorithm AS 241).
_MIDDLE = (
    (2509.0809287301227, 5226.495278852854),
    (33430.57558358813, 28729.085735721943),
    (67265.7709270087, 39307.89580009271),
    (45921.95393154987, 21213.794301586597),
    (13731.69376550946, 5394.196021424751),
    (1971.5909503065513, 687.1870074920579),
    (133.14166789178438, 42.31333070160091),
    (3.3871328727963665, 1.0),
)
_TAIL = (
    (0.0007745450142783414, 1.0507500716444169e-09),
    (0.022723844989269184, 0.0005475938084995345),
    (0.2417807251774506, 0.015198666563616457),
    (1.2704582524523684, 0.14810397642748008),
    (3.6478483247632045, 0.6897673349851),
    (5.769497221460691, 1.6763848301838038),
    (4.630337846156546, 2.053191626637759),
    (1.4234371107496835, 1.0),
)


def standard_quantiles(shares: np.ndarray) -> np.ndarray:
    """Return the quantiles of the standard normal distribution at the probabilities ``shares``, both of shape (n,).

    The error is about 1e-15 for probabilities from 1e-10 to 1 - 1e-10.
    """
    q = shares - 0.5
    middle = np.abs(q) <= 0.425
    tail = np.sqrt(-of_each(logarithm, np.where(q < 0.0, shares, 1.0 - shares))) - 1.6
    r = np.where(middle, 0.180625 - q * q, tail)
    numerator, denominator = np.zeros((2, len(shares)))
    for (above, below), (tail_above, tail_below) in zip(_MIDDLE, _TAIL, strict=True):
        numerator = numerator * r + np.where(middle, above, tail_above)
        denominator = denominator * r + np.where(middle, below, tail_below)
    return np.where(middle, q, np.where(q < 0.0, -1.0, 1.0)) * (numerator / denominator)


def standard_shares(values: np.ndarray) -> np.ndarray:
    """Return the probabilities that a standard normal variable is below ``values``, both of shape (n,).

    The error is below 1e-15, by Marsaglia's series of the normal distribution. Values beyond 8 count as 8.
    """
    x = np.clip(values, -8.0, 8.0)
    term = total = x
    for k in range(3, 200, 2):
        term = term * (x * x / k)
        total = total + term
    density = 0.3989422804014327 * of_each(exponential, -0.5 * x * x)
    return np.clip(0.5 + density * total, 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """The distribution of a random number between ``low`` and ``high``, in ``unit``."""

    unit: str
    low: float
    high: float
    kind: str = "uniform"
    """One of :data:`KINDS`; those that are drawn are symmetric about the mean"""
    whole: bool = False
    """Whether the number is an integer, drawn with equal probabilities, ends included"""
    values: tuple[float, ...] = ()
    """The values of a grid in their order, empty for the other kinds"""

    @property
    def middle(self) -> float:
        """The mean, rounded down for integers; it stands for the number wherever none is drawn, as in checks.

        Of a grid, it is the value in the middle of the list.
        """
        if self.values:
            return self.values[len(self.values) // 2]
        mean = (self.low + self.high) / 2.0
        return float(np.floor(mean)) if self.whole else rounded(mean)

    def quantiles(self, shares: np.ndarray) -> np.ndarray:
        """Return the quantiles at the probabilities ``shares``, both of shape (n,), rounded to 15 digits."""
        if self.kind == "normal":
            deviation = (self.high - self.low) / (2.0 * TRUNCATION)
            values = (self.low + self.high) / 2.0 + deviation * standard_quantiles(
                _BELOW + (1.0 - 2.0 * _BELOW) * shares
            )
            values = np.where(shares == 0.0, self.low, values)
        elif self.whole:
            values = np.floor(self.low + (self.high - self.low + 1.0) * shares)
        else:
            values = self.low + (self.high - self.low) * shares
        # Rounded as in a scenario file, so that a flight of the campaign is the same when flown from such a file.
        return np.array([rounded(value) for value in np.where(shares == 1.0, self.high, values).tolist()])


def read_distribution(given: Mapping[str, Any], unit: str, field: str, *, whole: bool = False) -> Distribution:
    """Return the distribution in the inline table ``given`` for a scenario's ``field``, whose numbers are in ``unit``.

    Raises:
        QuantityError: The kind is unknown, the values are not quantities in ``unit``, two unless it is a grid, the
            least is not below the largest, the deviation is not positive, or a value of a grid is repeated. With
            ``whole``, only ``uniform`` and ``grid`` with integers are accepted.
    """
    forms = " or ".join(f"{{ {kind} = {pair} }}" for kind, pair in KINDS.items())
    if len(given) != 1 or next(iter(given)) not in KINDS:
        raise QuantityError(f"{field} = {given!r}: expected a number or {forms}")
    [(kind, pair)] = given.items()
    if not isinstance(pair, list | tuple) or (len(pair) != 2 if kind != "grid" else not pair):
        raise QuantityError(f"{field} = {given!r}: expected {kind} = {KINDS[kind]}")
    try:
        numbers = [parse_quantity(value, unit, kind) for value in pair]
    except QuantityError as error:
        raise QuantityError(f"{field} = {given!r}: {error}") from error
    if kind == "grid":
        values = tuple(map(rounded, numbers))
        if len(set(values)) < len(values) or (whole and not all(value.is_integer() for value in values)):
            raise QuantityError(f"{field} = {given!r}: expected different {'whole ' if whole else ''}numbers")
        return Distribution(unit=unit, low=min(values), high=max(values), kind=kind, whole=whole, values=values)
    first, second = numbers
    if whole and (kind != "uniform" or not (first.is_integer() and second.is_integer())):
        raise QuantityError(f"{field} = {given!r}: expected uniform = {KINDS['uniform']}, both whole numbers")
    if kind == "normal":
        if not second > 0.0:
            raise QuantityError(f"{field} = {given!r}: expected a standard deviation above zero")
        first, second = first - TRUNCATION * second, first + TRUNCATION * second
    if not first < second:
        raise QuantityError(f"{field} = {given!r}: expected a least value below the largest")
    return Distribution(unit=unit, low=rounded(first), high=rounded(second), kind=kind, whole=whole)

"""The worst flight within the bounds of a campaign: signs, corner, flips, line searches, and random restarts.

Most metrics are monotonic in almost every parameter. One-at-a-time flights give the better sign of each, the corner of
these signs is flown, then each factor is flipped alone until nothing improves. A factor whose ends do not decide, such
as a time, is searched on a grid that is refined around its worst point. As many random flights follow, for comparison;
the worst of them are where the search starts anew with the rest of the budget.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from hsv.base.units import rounded
from hsv.flight.campaign.campaign import Factor
from hsv.flight.campaign.summary import Results
from hsv.flight.search.rows import is_margin, recorded

Point = tuple[float, ...]
"""A sample: one value per factor, in the factor's unit."""

GRID, REFINED, REFINEMENTS = 64, 8, 2
"""Intervals of the grid over a factor's range; intervals of each refinement of the two around the worst point; number
of refinements, after which a range of 150 s is resolved to 0.15 s. A coarser grid misses peaks of a few seconds."""

RESTARTS = 4
"""Largest number of restarts"""


class Phase(NamedTuple):
    """A part of the search: its name, its number of flights, and how bad the worst flight was after it."""

    name: str
    flights: int
    worst: float


@dataclass
class Worst:
    """The result of a search; how bad a flight is, is minus a margin or the magnitude of a metric."""

    flight: int
    """Number of the worst flight"""
    badness: float
    nominal: float
    """How bad the flight with all factors at their middle is"""
    random: float
    """How bad the worst of the random flights is, which are as many as those of the search before them"""
    random_flights: int
    phases: list[Phase]
    influences: dict[str, float]
    """By how much the worst flight is less bad if a factor alone moves to its other end, by factor, sorted"""
    flights: int

    def broken(self, goal: str) -> bool:
        """Whether the worst flight breaks a requirement, if the ``goal`` of the search is a margin."""
        return is_margin(goal) and self.badness > 0.0


class _BudgetSpentError(Exception):
    """All flights of the budget are flown."""


@dataclass
class _Search:
    fly: Callable[[np.ndarray], np.ndarray]
    factors: Sequence[Factor]
    budget: int
    known: dict[Point, float] = field(default_factory=dict)
    best: Point = ()
    phases: list[Phase] = field(default_factory=list)

    def evaluate(self, points: Sequence[Point]) -> list[float]:
        """Return how bad the flights of ``points`` are; those that were not flown before are flown together.

        Raises:
            _BudgetSpentError: The budget did not suffice for all; the flights that it sufficed for are known.
        """
        new = [point for point in dict.fromkeys(points) if point not in self.known]
        flown = new[: self.budget - len(self.known)]
        if flown:
            found = self.fly(np.array(flown)).tolist()
            self.known |= dict(zip(flown, found, strict=True))
        if len(flown) < len(new):
            raise _BudgetSpentError
        return [self.known[point] for point in points]

    def note(self, name: str) -> None:
        """Add the flights since the last phase to the phase ``name``."""
        flights = len(self.known) - sum(phase.flights for phase in self.phases)
        if flights:
            self.phases.append(Phase(name, flights, max(self.known.values())))

    def climb(self, point: Point, lines: Sequence[int]) -> Point:
        """Return the point that flips and line searches reach from ``point``, which none of them makes worse."""
        grid = {index: (high - low) / GRID for index in lines for low, high in [self.ends(index)]}
        over = {index: (step, self.ends(index)) for index, step in grid.items()}
        while True:
            start = point
            point = self.flips(point)
            self.note("flips")
            for index, (step, ends) in over.items():
                point = self.line(point, index, step, ends)
            self.note("line searches")
            # The next searches are only around the place that the whole grid gave.
            over = {index: (2.0 * step / REFINED, self.around(point, index, step)) for index, step in grid.items()}
            if point == start or not lines:
                return point

    def flips(self, point: Point) -> Point:
        """Move single factors to their other ends, and all that help together, as long as the flights get worse."""
        while True:
            [here] = self.evaluate([point])
            moves = [self.moved(point, i, end) for i in range(len(point)) for end in self.ends(i) if end != point[i]]
            gains = [value - here for value in self.evaluate(moves)]
            helpful = [move for move, gain in zip(moves, gains, strict=True) if gain > 0.0]
            if not helpful:
                return point
            together = list(point)
            for move in sorted(helpful, key=lambda move: self.known[move]):  # of two ends, the worse one remains
                together = [m if m != p else t for m, p, t in zip(move, point, together, strict=True)]
            point = self.worst_of([*helpful, tuple(together)])

    def line(self, point: Point, index: int, step: float, ends: tuple[float, float]) -> Point:
        """Return the worst point along one factor: in steps between ``ends``, refined around the worst point."""
        for _ in range(REFINEMENTS + 1):
            low, high = ends
            values = [low + step * k for k in range(round((high - low) / step) + 1)]
            values = [float(np.floor(v)) if self.factors[index].whole else rounded(v) for v in values]
            point = self.worst_of([point, *(self.moved(point, index, min(value, high)) for value in values)])
            ends, step = self.around(point, index, step), 2.0 * step / REFINED
        return point

    def around(self, point: Point, index: int, step: float) -> tuple[float, float]:
        """Return the values of a factor one ``step`` below and above its value at ``point``, within its range."""
        low, high = self.ends(index)
        return max(low, point[index] - step), min(high, point[index] + step)

    def worst_of(self, points: Sequence[Point]) -> Point:
        """Return the worst of ``points``, the first one of several."""
        values = self.evaluate(points)
        return points[values.index(max(values))]

    def ends(self, index: int) -> tuple[float, float]:
        """Return the least and the largest value of a factor."""
        return self.factors[index].low, self.factors[index].high

    def moved(self, point: Point, index: int, value: float) -> Point:
        """Return ``point`` with another value of one factor."""
        return (*point[:index], value, *point[index + 1 :])

    def influences(self, worst: Point) -> dict[str, float]:
        """Return :attr:`Worst.influences` from the flights that are known."""
        found = {}
        for index, factor in enumerate(self.factors):
            moves = [self.moved(worst, index, end) for end in self.ends(index) if end != worst[index]]
            values = [self.known[move] for move in moves if move in self.known]
            if values and math.isfinite(self.known[worst]):
                found[factor.name] = self.known[worst] - min(values)
        return dict(sorted(found.items(), key=lambda item: -item[1]))


def find_worst(fly: Callable[[np.ndarray], np.ndarray], factors: Sequence[Factor], budget: int, seed: int = 1) -> Worst:
    """Return the worst flight within the bounds of ``factors``.

    The search is deterministic: it depends on how bad the flights are, not on the order in which they are flown.

    Args:
        fly: Returns how bad the flights of samples (n, factors) are, shape (n,).
        factors: The factors that vary.
        budget: Largest number of flights, at least :func:`least_budget`.
        seed: Seed of the random flights.
    """
    search = _Search(fly, factors, budget)
    centre = tuple(factor.middle for factor in factors)
    singles = [[search.moved(centre, i, end) for end in search.ends(i)] for i in range(len(factors))]
    drawn: list[Point] = []
    [nominal, *_] = search.evaluate([centre, *(point for pair in singles for point in pair)])
    search.note("one factor at a time")
    try:
        decided = [[search.known[point] for point in pair] for pair in singles]
        lines = [
            i
            for i, (pair, factor) in enumerate(zip(decided, factors, strict=True))
            if factor.unit == "s" or nominal > max(pair)
        ]
        search.evaluate([corner := tuple(search.ends(i)[int(pair[1] > pair[0])] for i, pair in enumerate(decided))])
        search.note("corner of the worse signs")
        search.climb(corner, lines)
        count = min(len(search.known), budget - len(search.known))
        shares = np.random.default_rng(seed).random((count, len(factors))).T
        columns = [factor.quantiles(share) for factor, share in zip(factors, shares, strict=True)]
        search.evaluate(drawn := [tuple(row) for row in np.column_stack(columns).tolist()])
        search.note("random flights")
        for point in sorted(drawn, key=lambda point: -search.known[point])[:RESTARTS]:
            if search.known[point] < math.inf:
                search.climb(point, lines)
    except _BudgetSpentError:
        search.note("until the budget was spent")
    points = list(search.known)
    worst = max(points, key=lambda point: search.known[point])
    random = max((search.known[point] for point in drawn), default=-math.inf)
    return Worst(
        points.index(worst),
        search.known[worst],
        nominal,
        random,
        len(drawn),
        search.phases,
        search.influences(worst),
        len(points),
    )


def repeated(results: Results) -> Worst:
    """Return the result of a finished search, which is repeated with the stored flights."""
    campaign = results.campaign
    return find_worst(recorded(results), campaign.factors, campaign.budget, campaign.seed)


def least_budget(factors: Sequence[Factor]) -> int:
    """Return the smallest budget of a search: one factor at a time, the corner of the signs, and one flip of each."""
    return 3 * len(factors) + 2

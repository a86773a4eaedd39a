"""The worst flight within the bounds of a campaign: signs, corner, flips, line searches, and random restarts.

Most metrics are monotonic in almost every parameter. One-at-a-time flights give the better sign of each, the corner of
these signs is flown, then each factor is flipped alone until nothing improves. A factor whose ends do not decide, such
as a time, is searched on a grid that is refined around its worst point. As many random flights follow, for comparison;
the worst of them are where the search starts anew with the rest of the budget.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from hsv.base.units import rounded
from hsv.flight.campaign.campaign import Campaign, Factor
from hsv.flight.search.rows import Flown, is_margin

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
    """By how much the worst flight is less bad if a factor alone moves to its other end, by factor, sorted.

    Factors are left out if a flight was lost, does not define the metric, or was not flown within the budget.
    """
    flights: int

    def broken(self, goal: str) -> bool:
        """Whether the worst flight breaks a requirement, if the ``goal`` of the search is a margin."""
        return is_margin(goal) and self.badness > 0.0


class _BudgetSpentError(Exception):
    """All flights of the budget are flown."""


@dataclass
class _Search:
    fly: Flown
    factors: Sequence[Factor]
    budget: int
    known: dict[Point, float] = field(default_factory=dict)
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

    def climb(self, point: Point, lines: Sequence[int]) -> None:
        """Repeat flips, and line searches along the factors ``lines``, until neither finds a worse point."""
        start: Point = ()
        refined = 0
        while point != start:
            start = point
            point = self.flips(point)
            self.note("flips")
            for index in lines:
                point = self.line(point, index, refined)
            self.note("line searches")
            refined = 1  # the next searches are only around the place that the whole grid gave

    def flips(self, point: Point) -> Point:
        """Move single factors to their other ends, and all that help together, as long as the flights get worse."""
        while True:
            moves = [self.moved(point, i, end) for i in range(len(point)) for end in self.ends(i) if end != point[i]]
            [here] = self.evaluate([point])
            self.evaluate(moves)
            helpful = sorted((move for move in moves if self.known[move] > here), key=self.known.__getitem__)
            if not helpful:
                return point
            # Of the two ends of a factor, the worse one remains.
            changes = {i: end for move in helpful for i, end in enumerate(move) if end != point[i]}
            point = self.worst_of([*helpful, tuple(changes.get(i, value) for i, value in enumerate(point))])

    def line(self, point: Point, index: int, refined: int) -> Point:
        """Return the worst point along one factor, on grids around the last worst point from number ``refined`` on."""
        least, most = low, high = self.ends(index)
        step = (high - low) / GRID
        for refinement in range(refined, refined + REFINEMENTS + 1):
            if refinement:
                low, high = max(least, point[index] - step), min(most, point[index] + step)
                step *= 2.0 / REFINED
            values = [low + step * k for k in range(round((high - low) / step) + 1)]
            values = [float(np.floor(v)) if self.factors[index].whole else rounded(v) for v in values]
            point = self.worst_of([point, *(self.moved(point, index, min(value, high)) for value in values)])
        return point

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
            if values and math.isfinite(gain := self.known[worst] - min(values)):
                found[factor.name] = gain
        return dict(sorted(found.items(), key=lambda item: -item[1]))


def find_worst(fly: Flown, factors: Sequence[Factor], budget: int, seed: int = 1) -> Worst:
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
    singles = [search.moved(centre, i, end) for i in range(len(factors)) for end in search.ends(i)]
    nominal, *found = search.evaluate([centre, *singles])
    search.note("one factor at a time")
    pairs = [*zip(factors, found[::2], found[1::2], strict=True)]
    corner = tuple(factor.high if high > low else factor.low for factor, low, high in pairs)
    lines = [i for i, (factor, low, high) in enumerate(pairs) if factor.unit == "s" or nominal > max(low, high)]
    drawn: list[Point] = []
    try:
        search.evaluate([corner])
        search.note("corner of the worse signs")
        search.climb(corner, lines)
        count = min(len(search.known), budget - len(search.known))
        shares = np.random.default_rng(seed).random((count, len(factors))).T
        columns = [factor.quantiles(share) for factor, share in zip(factors, shares, strict=True)]
        drawn = [*map(tuple, np.column_stack(columns).tolist())]
        search.evaluate(drawn)
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


def of_campaign(campaign: Campaign, fly: Flown) -> Worst:
    """Return the worst flight of a ``campaign``, with its budget and its seed."""
    return find_worst(fly, campaign.factors, campaign.budget, campaign.seed)


def least_budget(factors: Sequence[Factor]) -> int:
    """Return the smallest budget of a search: one factor at a time, the corner of the signs, and one flip of each."""
    return 3 * len(factors) + 2

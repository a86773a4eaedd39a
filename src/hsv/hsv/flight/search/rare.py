"""The probability of a rare failure, by subset simulation (Au and Beck 2001), with an interval from independent runs.

A run begins with plain samples. The tenth of them with the smallest margins are the seeds of Markov chains, which stay
below the largest of these margins and whose steps are accepted in place of a rejected sample otherwise (conditional
sampling, Papaioannou et al. 2015). The probability of the failure is the product of these tenths and of the share of
failures in the last level. Runs with independent random numbers give an interval; one chain cannot.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import numpy as np

from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.summary import CONFIDENCE, clopper_pearson
from hsv.flight.distribution import standard_quantiles, standard_shares
from hsv.flight.search.rows import Flown

RUNS, KEPT = 10, 10
"""Number of independent runs, and the number of samples of a level for each seed of the next one."""

LEVELS = 6
"""Number of levels for which a budget is divided, enough for a probability of 1e-6; the largest number is twice it"""

_COST = RUNS * (KEPT + (LEVELS - 1) * (KEPT - 1))
"""Number of samples of all runs with :data:`LEVELS` levels, for each chain of a run"""

LEAST_BUDGET = 10 * _COST
"""Smallest number of samples for which an interval is estimated: 100 in a level"""

PLAIN = 100
"""Number of failures that plain sampling is expected to find with the budget, from which on it is preferred"""

_ACCEPTED = 0.44
"""Share of accepted steps to which the chains' step size is adapted"""

Margins = Callable[[np.ndarray], np.ndarray]
"""Returns the margins (n) of points (n, d) of independent standard normal variables; a negative one is a failure."""


@dataclass(frozen=True)
class Rare:
    """The probability of a failure, with its interval where it was measured."""

    probability: float
    interval: tuple[float, float] | None
    """Interval of :data:`CONFIDENCE`; None if some run did not reach the failure within the budget"""
    method: str
    """``subset simulation`` or ``plain sampling``"""
    runs: tuple[float, ...]
    """The probability by each independent run; empty for plain sampling"""
    levels: int
    """Largest number of levels of a run"""
    samples: int
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Run:
    probability: float
    levels: int
    failures: np.ndarray
    """Failed points (k, d) of the last level"""


def estimate(margins: Margins, d: int, budget: int, seed: int = 1) -> Rare:
    """Return the probability that ``margins`` of ``d`` independent standard normal variables are negative.

    Args:
        margins: The margin function.
        d: Number of variables.
        budget: Largest number of samples, at least :data:`LEAST_BUDGET`.
        seed: Seed of all random numbers.
    """
    size = budget // _COST * KEPT
    runs = [_run(np.random.default_rng([seed, run]), size, d) for run in range(RUNS)]
    asked = {number: next(run) for number, run in enumerate(runs)}
    found: dict[int, _Run] = {}
    samples = 0
    while asked and samples + (count := sum(map(len, asked.values()))) <= budget:
        values = margins(np.concatenate([*asked.values()]))
        if not samples and (failures := int(np.count_nonzero(values < 0.0))) * budget >= PLAIN * count:
            return _plain(margins, values, failures, budget, d, seed)
        samples += count
        parts = np.split(values, np.cumsum([*map(len, asked.values())])[:-1])
        for number, own in zip([*asked], parts, strict=True):
            try:
                asked[number] = runs[number].send(own)
            except StopIteration as end:
                found[number] = end.value
                del asked[number]
    reached = [found[number] for number in sorted(found)]
    each = tuple(run.probability for run in reached)
    levels = max((run.levels for run in reached), default=0)
    complete = len(reached) == RUNS and min(each) > 0.0
    warnings = tuple(_warnings(reached, size)) if complete else ("some runs did not reach the failure: no interval",)
    mean = float(np.mean([*each, *[0.0] * (RUNS - len(each))]))
    return Rare(mean, _interval(each) if complete else None, "subset simulation", each, levels, samples, warnings)


def _plain(margins: Margins, values: np.ndarray, failures: int, budget: int, d: int, seed: int) -> Rare:
    """Return the probability by plain sampling: the samples with these ``values``, and the rest of the budget."""
    others = margins(_normal(np.random.default_rng([seed, RUNS]), (budget - len(values), d)))
    failures += int(np.count_nonzero(others < 0.0))
    return Rare(failures / budget, clopper_pearson(failures, budget), "plain sampling", (), 1, budget, ())


def _run(random: np.random.Generator, size: int, d: int) -> Generator[np.ndarray, np.ndarray, _Run]:
    """Yield the points whose margins are needed, and receive the margins; return the result of the run."""
    points = _normal(random, (size, d))
    values = yield points
    probability, step = 1.0, 0.6
    for level in range(1, 2 * LEVELS + 1):
        order = np.argsort(values, kind="stable")
        bound = values[order[size // KEPT - 1]]
        if bound < 0.0 or level == 2 * LEVELS:
            failed = values < 0.0
            return _Run(probability * float(np.mean(failed)), level, points[failed])
        probability /= KEPT
        here, below = points[order[: size // KEPT]], values[order[: size // KEPT]]
        spread = here.std(axis=0)
        points, values = here, below
        for move in range(1, KEPT):
            sigma = np.minimum(1.0, step * spread)
            proposed = np.sqrt(1.0 - sigma * sigma) * here + sigma * _normal(random, here.shape)
            tried = yield proposed
            accepted = tried <= bound
            here, below = np.where(accepted[:, None], proposed, here), np.where(accepted, tried, below)
            step *= 1.0 + (float(np.mean(accepted)) - _ACCEPTED) / math.sqrt(move)
            points, values = np.concatenate((points, here)), np.concatenate((values, below))
    raise AssertionError


def _normal(random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return standard normal numbers that have the same bits on every processor."""
    return standard_quantiles(np.maximum(random.random(math.prod(shape)), 2.0**-54)).reshape(shape)


def _interval(each: Sequence[float]) -> tuple[float, float]:
    """Return the interval of the mean of estimates that are lognormal: Cox's method, with quantiles of Student's t."""
    from scipy.stats import t

    logs = np.log(each)
    n, variance = len(logs), float(logs.var(ddof=1))
    centre = float(logs.mean()) + 0.5 * variance
    half = float(t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)) * math.sqrt(variance / n + variance**2 / (2 * (n - 1)))
    return math.exp(centre - half), math.exp(centre + half)


def _warnings(runs: Sequence[_Run], size: int) -> list[str]:
    """Return warnings that a failure region may have been missed: by some runs, or by most of them."""
    found = []
    each = np.array([run.probability for run in runs])
    levels = max(run.levels for run in runs)
    # A chain's samples are correlated: about four times the variance of independent ones.
    expected = math.sqrt(4.0 * levels * (KEPT - 1) / size)
    if each.std(ddof=1) > 2.0 * expected * each.mean():
        found.append("the runs differ more than chance explains: some may have missed a failure region")
    apart = np.array([[_apart(a.failures, b.failures) for b in runs if b is not a] for a in runs])
    if apart.max() > 2.0 * np.median(apart):
        found.append("failures of a run lie far from those of another: some may have missed a failure region")
    return found


def _apart(first: np.ndarray, second: np.ndarray) -> float:
    """Return the distance to the nearest point of ``second`` that 98 % of the points of ``first`` do not exceed."""
    squares = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1) - 2.0 * first @ second.T
    return math.sqrt(max(0.0, float(np.quantile(squares.min(axis=1), 0.98))))


def of_campaign(campaign: Campaign, fly: Flown) -> Rare:
    """Return the probability that the margin that is the goal of a ``campaign`` is negative."""

    def margins(points: np.ndarray) -> np.ndarray:
        drawn = zip(campaign.factors, points.T, strict=True)
        return -fly(np.column_stack([factor.quantiles(standard_shares(column)) for factor, column in drawn]))

    return estimate(margins, len(campaign.factors), campaign.budget, campaign.seed)

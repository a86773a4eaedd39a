"""Flights with given samples on the engine of campaigns, stored so that an interrupted search continues."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from hsv.base.errors import CampaignError, one_of
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.sample_runner import OUTCOMES, in_child_of, outcomes_of, sample_runner
from hsv.flight.campaign.store import ResultStore, read_result
from hsv.flight.campaign.summary import Results, values_of
from hsv.flight.metrics import MARGIN
from hsv.flight.scenario import Scenario

EVERY_REQUIREMENT = "requirements"
"""The goal of a search that looks for the smallest margin of any requirement."""

_SMALL, _LARGE = 8, 64
"""Numbers of flights in a batch: of requests for fewer than 256 flights, and of larger ones."""

Flown = Callable[[np.ndarray], np.ndarray]
"""Flies samples (n, factors), and returns how bad the flights are, see :func:`badness`, shape (n,)."""


def check_goal(goal: str, scenario: Scenario, *, margins_only: bool = False) -> str:
    """Return the name of the metric that a search maximises, or :data:`EVERY_REQUIREMENT`, the default.

    ``goal`` is a metric, or a requirement by its name or by that of its margin; with ``margins_only``, a requirement.

    Raises:
        CampaignError: There is no such metric or requirement, or no goal is given and the scenario has no requirement.
    """
    named = {requirement.name: requirement.metric for requirement in scenario.requirement}
    if not goal:
        if not named:
            other = "" if margins_only else ", or --of METRIC"
            raise CampaignError(f"scenario {scenario.name!r}: has no requirement, expected one{other}")
        return EVERY_REQUIREMENT
    known = (*named.values(), *named) if margins_only else (*outcomes_of(scenario), *named)
    if margins_only and goal in OUTCOMES:
        raise CampaignError(f"of = {goal!r}: a metric, expected a requirement of the scenario")
    if goal not in known:
        raise CampaignError(f"of = {goal!r}: expected {one_of(known, goal)}")
    return named.get(goal, goal)


def is_margin(goal: str) -> bool:
    """Return whether ``goal`` is the margin of one or every requirement, so that positive badness is a failure."""
    return goal not in OUTCOMES


def badness(campaign: Campaign, column: Callable[[str], np.ndarray], lost: np.ndarray) -> np.ndarray:
    """Return how bad flights are, shape (n,): minus the smallest margin, or the magnitude of the metric.

    Args:
        campaign: The campaign, whose goal names the metric.
        column: Returns a column of the results by name; undefined numbers are NaN.
        lost: Whether each flight is lost (n); it is infinitely bad. A flight without the metric is not bad at all.
    """
    goal = campaign.goal
    names = [goal] if goal != EVERY_REQUIREMENT else [each.metric for each in campaign.scenario.requirement]
    values = [-column(name) if name.startswith(MARGIN) else np.abs(column(name)) for name in names]
    worst = np.max(values, axis=0)
    return np.where(lost, math.inf, np.where(np.isnan(worst), -math.inf, worst))


def recorded_badness(results: Results) -> np.ndarray:
    """Return how bad the flights of a finished search are, shape (flights,), in their order."""
    return badness(results.campaign, results.column, ~results.finished)


def recorded(results: Results) -> Flown:
    """Return a function in place of :meth:`Rows.evaluate` that repeats a finished search with its stored flights."""
    found = iter(recorded_badness(results).tolist())
    return lambda samples: np.array([next(found) for _ in samples])


class Rows(ResultStore):
    """The flights of a search in the order of the requests: stored ones are read, the others are flown."""

    def __init__(self, out: Path, campaign: Campaign, executor: Executor, progress: Callable[[int], None]) -> None:
        """Store the flights in the result file ``out``; ``progress`` is called with the number of finished flights."""
        super().__init__(out, campaign)
        self._executor, self._progress = executor, progress
        self.flown = self.flown_now = self._parts = 0

    def run(self, search: Callable[[Campaign, Flown], object], *, restart: bool = False) -> None:
        """Call ``search`` with the campaign and :meth:`evaluate`, unless the result file exists, and write this file.

        Raises:
            CampaignError: The results belong to another search, are in use or damaged, or cannot be written.
            RunError: A batch crashes a worker, a worker cannot start or has another version, or the scheduler is lost.
        """
        with self.opened(restart=restart):
            if not self.out.exists():
                search(self._campaign, self.evaluate)
                self._campaign = replace(self._campaign, samples=self.flown)
                self.finish()

    def finished(self, restart: bool) -> set[int]:
        """Open the results, or discard them with ``restart``; a search has no batches before it flies."""
        if self.out.exists() and not restart:
            self._check(replace(read_result(self.out)[0], samples=self._campaign.samples), self.out)
            return set()
        return super().finished(restart)

    def numbers(self) -> range:
        """Return the numbers of the parts."""
        return range(self._parts)

    def evaluate(self, samples: np.ndarray) -> np.ndarray:
        """Return how bad the flights with these ``samples``, shape (n, factors), are, shape (n,)."""
        width = _SMALL if len(samples) < 4 * _LARGE else _LARGE
        cuts = [samples[start : start + width] for start in range(0, len(samples), width)]
        first, begin = self.flown, self._parts
        given = {"campaign": self._campaign.text, "first": first, "samples": [cut.tolist() for cut in cuts]}
        missing = [number for number, cut in enumerate(cuts) if not self._has(begin + number, cut)]
        self.flown, self._parts = first + len(samples), begin + len(cuts)
        left = sum(len(cuts[number]) for number in missing)
        for number, content in self._executor.fly(fly_given, json.dumps(given), missing):
            self.keep(begin + number, content)
            left -= len(cuts[number])
            self.flown_now += len(cuts[number])
            self._progress(self.flown - left)
        return np.concatenate([self._badness(self._read(part)[0]) for part in range(begin, self._parts)])

    def _badness(self, part: pa.Table) -> np.ndarray:
        lost = values_of(part["diverged"]) | values_of(part["crashed"].is_valid())
        return badness(self._campaign, lambda name: values_of(part[name]), lost)

    def _has(self, number: int, samples: np.ndarray) -> bool:
        """Return whether a whole part with these samples is stored."""
        try:
            part, _ = self._read(number)
        except CampaignError:
            return False
        names = [f"sample_{factor.name}" for factor in self._campaign.factors]
        return np.array_equal(np.column_stack([values_of(part[name]) for name in names]), samples)


def fly_given(text: str, batch: int) -> bytes:
    """Fly a batch of the samples in the JSON ``text``; return its table as :meth:`SampleRunner.table` does."""
    return in_child_of(sample_runner(json.loads(text)["campaign"]), _fly_given, text, batch)


def _fly_given(text: str, batch: int) -> bytes:
    given = json.loads(text)
    first = given["first"] + sum(map(len, given["samples"][:batch]))
    samples = np.array(given["samples"][batch], float)
    return sample_runner(given["campaign"]).table(range(first, first + len(samples)), samples)

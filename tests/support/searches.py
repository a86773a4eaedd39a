"""Searches in tests: their campaigns, and flights in memory in place of stored ones."""

import itertools
import math
from dataclasses import replace

import numpy as np
import tomli_w

from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.sample_runner import SampleRunner
from hsv.flight.search.rows import badness


def search(method, name, goal, budget, **others):
    """Return the campaign of a search."""
    return replace(plan(name, samples=1, **others), method=method, goal=goal, budget=budget, samples=0)


def in_memory(campaign):
    """Return a function that flies samples and returns how bad the flights are."""
    runner, flown = SampleRunner(campaign), itertools.count()

    def fly(samples):
        rows = [runner.outcome(f) for f in runner.fly_all([next(flown) for _ in samples], samples)]
        lost = np.array([row["diverged"] or row["crashed"] is not None for row in rows])
        return badness(campaign, lambda name: np.array([row.get(name, math.nan) for row in rows], float), lost)

    return fly


def required(folder, at_most, **fields):
    """Write a variant of case1 that requires an attitude of ``at_most``, after the fault if any; return its path."""
    row = {"name": "a", "signal": "attitude_from_nominal", "at_most": at_most, "always": True}
    row |= {} if fields.get("fault") == [] else {"from": "fault"}
    table = {"extends": "case1", "title": "required", "requirement": [row]} | fields
    (path := folder / "required.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    return str(path)

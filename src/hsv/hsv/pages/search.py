"""The section of a campaign page on a search: for the worst flight, or for the probability of a failure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hsv.base.units import UnitSystem, quantity_text, significant
from hsv.flight.campaign.campaign import RARE, Campaign
from hsv.flight.campaign.sample_runner import OUTCOMES
from hsv.flight.campaign.summary import Results
from hsv.flight.metrics import spaced
from hsv.flight.search import rare, worst
from hsv.flight.search.rows import is_margin, recorded, recorded_badness
from hsv.pages.engine import Numbers, Plot
from hsv.pages.picture import picture
from hsv.pages.text import capitalised


def in_words(campaign: Campaign, badness: float, units: UnitSystem, *, change: bool = False) -> str:
    """Return how bad a flight is as text: the margin and whether it is kept, or the metric with its unit.

    With ``change``, ``badness`` is a difference, and so is the text.
    """
    if math.isinf(badness):
        return "lost" if badness > 0.0 else "undefined"
    if not is_margin(campaign.goal):
        return quantity_text(badness, OUTCOMES[campaign.goal], units)
    if change:
        return significant(badness)
    return f"margin {significant(-badness)}, {'broken' if badness > 0.0 else 'kept'}"


def search_section(results: Results, numbers: Numbers) -> dict[str, Any]:
    """Return the data of the section: the search, the picture of its flights, and the influences of the factors."""
    campaign = results.campaign
    method = rare if campaign.method == RARE else worst
    found = method.of_campaign(campaign, recorded(results))
    influences = found.influences if isinstance(found, worst.Worst) else {}
    bad = recorded_badness(results)
    sign = -1.0 if is_margin(campaign.goal) else 1.0
    finite = np.where(np.isfinite(bad), bad, np.nan)
    x = numbers.add(np.arange(len(bad), dtype=float))
    curves = [
        {"kind": kind, "run": run, "x": x, "y": numbers.add(sign * values)}
        for kind, run, values in (("nominal", 0, finite), ("actual", 1, np.fmax.accumulate(finite)))
    ]
    title = "Margin" if is_margin(campaign.goal) else capitalised(spaced(campaign.goal))
    plot = Plot("search", title, OUTCOMES.get(campaign.goal, "1"), "", curves)
    most = max(influences.values(), default=0.0) or 1.0
    return {
        "found": found,
        "badness": bad.tolist(),
        "said": lambda badness: in_words(campaign, badness, UnitSystem.metric),
        "picture": picture([plot], numbers, float(len(bad)), axis="flight", kinds=("nominal", "actual")),
        "bars": [
            (spaced(name), in_words(campaign, gain, UnitSystem.metric, change=True), 100.0 * max(gain, 0.0) / most)
            for name, gain in influences.items()
        ],
    }

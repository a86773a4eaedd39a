"""Comparison of campaigns: the same vehicles with the same noise in pairs, and intervals of the differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.base.errors import CampaignError, one_of
from hsv.flight.campaign.summary import CONFIDENCE, clopper_pearson, percentiles
from hsv.flight.metrics import CRITERIA, METRICS

if TYPE_CHECKING:
    from pandas import DataFrame

ENDED = "flown_to_the_end"
"""Name of the first rows of a comparison, with the share of the flights that reach their end."""


def compare_campaigns(frames: Mapping[str, DataFrame], metrics: Sequence[str] = ()) -> DataFrame:
    """Return a table that compares campaigns with the first of them, with a row for each metric and campaign.

    Flights with the same sample and noise are pairs. Columns: ``metric``, ``campaign``, ``unit`` (SI); ``flights``,
    the finished flights to which the metric applies; ``within``, the share of them within the limit of the first
    campaign that has one; ``median`` and ``percentile_95`` of the magnitude, where a time that was not reached is
    infinite; then, of the pairs that both flights finish, their number ``pairs``, the median ``difference`` from the
    first campaign with its 95 % interval (``low``, ``high``), and ``better``, the share of the pairs in which the
    magnitude is smaller, or the margin of a requirement larger. The interval is that of the percentile bootstrap.

    In the first rows, ``flown_to_the_end``, ``within`` is the share of the flights that finish, and ``difference`` its
    difference over all pairs. ``attrs["pairs"]`` counts the pairs of each campaign and those that were dropped.

    Args:
        frames: Campaigns as :func:`hsv.read_campaign` returns them, by label; at least two.
        metrics: Names of metrics; empty: those that a campaign limits or, without limits, the paper's criteria.

    Raises:
        CampaignError: The campaigns have no pair, or differ in seed, method or metrics; the message says why.
    """
    if len(frames) < 2:
        raise CampaignError(f"{len(frames)} campaign: expected at least two to compare")
    (label, first), *others = frames.items()
    for other, frame in others:
        for key in ("seed", "method"):
            if frame.attrs[key] != first.attrs[key]:
                raise CampaignError(
                    f"{other}: {key} {frame.attrs[key]}, {label} has {first.attrs[key]}; "
                    "expected the same, which means the same vehicles and noise"
                )
    limited = {name: None for frame in frames.values() for name in (*frame.attrs["limits"], *frame.attrs["required"])}
    chosen = list(metrics) or [*limited] or list(CRITERIA)
    for name in chosen:
        for each, frame in frames.items():
            known = [column for column, unit in frame.attrs["units"].items() if unit and "sample_" not in column]
            if name not in known:
                raise CampaignError(f"metric {name!r}: not in {each}, expected {one_of(known, name)}")
    limits = {name: limit for frame in reversed([*frames.values()]) for name, limit in frame.attrs["limits"].items()}
    pairs = {other: _pairs(label, first, other, frame) for other, frame in others}
    rows = []
    for name in (ENDED, *chosen):
        for each, frame in frames.items():
            row = {"metric": name, "campaign": each} | (
                _ended(frame) if name == ENDED else _statistics(frame, name, limits)
            )
            if each in pairs:
                row |= _ended_in(*pairs[each]) if name == ENDED else _difference(name, *pairs[each])
            rows.append(row)
    from pandas import DataFrame

    table = DataFrame(rows)
    table.attrs["pairs"] = {other: _counts(first, frame, *pairs[other]) for other, frame in others}
    return table


def _lost(frame: DataFrame) -> np.ndarray:
    return np.asarray(frame["diverged"] | frame["crashed"].notna())


def _sizes(frame: DataFrame, name: str) -> np.ndarray:
    """Return the magnitudes (margins: values) of a metric, infinite if not reached, NaN if lost or not applicable."""
    values = frame[name].to_numpy(float, copy=True)
    values[np.asarray(frame["not_reached"].fillna("").str.contains(name, regex=False))] = np.inf
    values[_lost(frame)] = np.nan
    return np.abs(values) if name in METRICS and METRICS[name].signed else values


def _pairs(label: str, first: DataFrame, other: str, frame: DataFrame) -> tuple[DataFrame, DataFrame]:
    """Return the rows of the flights of two campaigns that are pairs, in the same order."""
    keys = [[column for column in each if column.startswith("sample_")] for each in (first, frame)]
    if differing := set(keys[0]) ^ set(keys[1]):
        names = ", ".join(sorted(column.removeprefix("sample_") for column in differing))
        raise CampaignError(f"{label}, {other}: no pairs, only one of them varies {names}; expected the same factors")
    given = [
        each[keys[0]].assign(vehicle=each["flight"] % each.attrs["vehicles"], row=range(len(each)))
        for each in (first, frame)
    ]
    found = given[0].merge(given[1], on=[*keys[0], "vehicle"])
    if not len(found):
        raise CampaignError(f"{label}, {other}: no pairs, no flight has the same sample in both")
    return first.iloc[found["row_x"]], frame.iloc[found["row_y"]]


def _counts(first: DataFrame, frame: DataFrame, a: DataFrame, b: DataFrame) -> dict[str, int]:
    here, there = _lost(b), _lost(a)
    counts = {"both_finish": ~here & ~there, "lost_only_here": here & ~there, "lost_only_in_first": there & ~here}
    counts["lost_in_both"] = here & there
    alone = len(first) + len(frame) - 2 * len(a)
    return {name: int(np.sum(mask)) for name, mask in counts.items()} | {"without_partner": alone}


def _ended(frame: DataFrame) -> dict[str, Any]:
    return {"unit": "1", "flights": len(frame), "within": float(np.mean(~_lost(frame)))}


def _ended_in(a: DataFrame, b: DataFrame) -> dict[str, Any]:
    """Return the difference of the shares that finish; its interval joins those of the two kinds of unequal pairs."""
    n, gained, given = len(a), int(np.sum(_lost(a) & ~_lost(b))), int(np.sum(~_lost(a) & _lost(b)))
    wide = 1.0 - (1.0 - CONFIDENCE) / 2.0
    (low_gain, high_gain), (low_loss, high_loss) = (clopper_pearson(count, n, wide) for count in (gained, given))
    ends = {"low": low_gain - high_loss, "high": high_gain - low_loss}
    return {"pairs": n, "difference": (gained - given) / n, **ends, "better": gained / n}


def _statistics(frame: DataFrame, name: str, limits: Mapping[str, float]) -> dict[str, Any]:
    values = _sizes(frame, name)
    values = values[~np.isnan(values)]
    middle, high = percentiles(values, (50.0, 95.0)) if len(values) else (np.nan, np.nan)
    row = {"unit": frame.attrs["units"][name], "flights": len(values), "median": middle, "percentile_95": high}
    if len(values) and name in frame.attrs["required"]:
        row["within"] = float(np.mean(values >= 0.0))
    elif len(values) and name in limits:
        row["within"] = float(np.mean(values <= limits[name]))
    return row


def _difference(name: str, a: DataFrame, b: DataFrame) -> dict[str, Any]:
    with np.errstate(invalid="ignore"):  # of two times that were not reached, there is no difference
        found = _sizes(b, name) - _sizes(a, name)
    found = np.sort(found[~np.isnan(found)])
    if not len(found):
        return {"pairs": 0}
    low, high = median_interval(found)
    smaller = found > 0.0 if name in (*a.attrs["required"], *b.attrs["required"]) else found < 0.0
    ends = {"low": low, "high": high, "better": float(np.mean(smaller))}
    return {"pairs": len(found), "difference": percentiles(found, (50.0,))[0], **ends}


def median_interval(ordered: np.ndarray) -> tuple[float, float]:
    """Return the percentile bootstrap interval of the median of ``ordered`` values, shape (n,), without resampling.

    The median of a resample is one of the values; of n uniform draws, the m-th smallest has a beta distribution.
    """
    from scipy.stats import beta

    n = len(ordered)
    m = (n + 1) // 2
    shares = beta.ppf([(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0], m, n + 1 - m)
    low, high = np.minimum((n * shares).astype(int), n - 1)
    return float(ordered[low]), float(ordered[high])

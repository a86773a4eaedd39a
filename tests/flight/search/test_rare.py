"""The probability of rare failures: on functions with a known probability, and on flights."""

import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from searches import in_memory, required, search

from hsv.flight.campaign.campaign import RARE
from hsv.flight.campaign.summary import clopper_pearson
from hsv.flight.search.rare import estimate, of_campaign

PROBABILITY = 1e-5
BETA = -NormalDist().inv_cdf(PROBABILITY)


def linear(points):
    """Return margins of ten variables that are negative with the probability 1e-5."""
    return BETA - points.sum(axis=1) / math.sqrt(10.0)


def two_regions(points):
    """Return margins with a failure probability of 3.865e-4, of which 2.9e-5 lie where x1 + x2 < 4."""
    x1, x2 = (points + 0.25).T
    return 20.0 - (x1 - x2) ** 2 - 8.0 * (x1 + x2 - 4.0) ** 3


def of_plain(found, probability):
    """Return the samples as a share of those for which plain sampling has an interval of the same width."""
    low, high = found.interval
    return found.samples * (high - low) ** 2 / ((2.0 * 1.96) ** 2 * probability * (1.0 - probability))


@pytest.mark.parametrize("count", [2, pytest.param(100, marks=pytest.mark.long)])
def test_intervals_cover_a_probability_of_1e5_with_two_percent_of_the_samples_of_plain_sampling(count):
    found = [estimate(linear, 10, 44_000, seed) for seed in range(count)]
    covering = sum(each.interval[0] <= PROBABILITY <= each.interval[1] for each in found)
    assert covering >= 0.9 * count - (count < 100)
    assert np.mean([of_plain(each, PROBABILITY) for each in found]) <= 0.02
    assert np.mean([each.probability for each in found]) == pytest.approx(PROBABILITY, rel=2.0 / math.sqrt(count))
    assert all(each.samples <= 44_000 and each.method == "subset simulation" for each in found)


def test_both_regions_are_found_or_the_warning_is_printed():
    for seed in range(5):
        asked = []

        def margins(points, asked=asked):
            asked.append(points)
            return two_regions(points)

        found = estimate(margins, 2, 44_000, seed)
        failed = np.concatenate(asked)
        failed = failed[two_regions(failed) < 0.0]
        assert found.interval[0] <= 3.865e-4 <= found.interval[1]
        assert (failed.sum(axis=1) + 0.5 < 4.0).mean() > 0.02 or found.warnings


def test_a_region_that_some_runs_miss_is_reported():
    def margins(points):  # the second region is small, far away, and no other sample leads there
        return np.where(points[:, 0] < -3.6, -1.0, 3.2 - points[:, 0])

    warned = [bool(estimate(margins, 2, 8_000, seed).warnings) for seed in range(5)]
    assert any(warned)
    assert not any(estimate(linear, 10, 44_000, seed).warnings for seed in range(2))


def test_plain_sampling_is_preferred_where_it_is_cheaper_and_has_its_exact_interval():
    found = estimate(lambda points: points[:, 0] + 1.0, 3, 6_000)
    assert found.method == "plain sampling" and found.samples == 6_000
    assert found.interval == clopper_pearson(round(found.probability * 6_000), 6_000)
    assert found.interval[0] < NormalDist().cdf(-1.0) < found.interval[1]


def test_no_interval_is_given_that_was_not_measured():
    never = estimate(lambda points: 1.0 + points[:, 0] ** 2, 2, 6_000)
    assert never.interval is None and never.warnings and never.samples <= 6_000


def test_lost_flights_are_failures_and_the_same_seed_gives_the_same_result():
    found = estimate(lambda points: np.where(points[:, 0] > 3.0, -math.inf, 3.0 - points[:, 0]), 2, 20_000)
    assert found.interval[0] <= 1.0 - NormalDist().cdf(3.0) <= found.interval[1]
    assert estimate(linear, 10, 6_000) == estimate(linear, 10, 6_000)


@pytest.mark.long
def test_the_interval_of_a_scenario_agrees_with_a_plain_campaign(tmp_path):
    campaign = search(RARE, required(tmp_path, "0.447 deg"), "margin_a", 8_000)
    found = of_campaign(campaign, in_memory(campaign))
    assert found.method == "subset simulation" and found.samples <= 8_000
    drawn, _ = replace(campaign, method="uniform", samples=10_000, seed=5).draw(range(10_000))
    failures = int(np.count_nonzero(in_memory(campaign)(drawn) > 0.0))
    low, high = clopper_pearson(failures, len(drawn))
    assert 0.5e-3 < failures / len(drawn) < 2e-3
    assert found.interval[0] <= high and low <= found.interval[1]

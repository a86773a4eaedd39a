"""The search for the worst flight: on functions whose largest value is known, and on flights."""

import itertools
import math

import numpy as np
import pytest
from searches import in_memory, search

from hsv.flight.campaign.campaign import WORST, Factor, plan
from hsv.flight.campaign.sample_runner import SampleRunner
from hsv.flight.search.worst import find_worst, least_budget, of_campaign

FACTORS = [Factor(name=f"p{i}", unit="1", low=-1.0, high=1.0 + i) for i in range(6)]
ANY_TIME = {"fault[0].start": ("0.5 s", "150 s")}


def found(name, goal, budget=64, **others):
    """Return the worst flight of a campaign."""
    campaign = search(WORST, name, goal, budget, **others)
    return of_campaign(campaign, in_memory(campaign))


@pytest.mark.parametrize("seed", range(20))
def test_the_worst_corner_of_a_function_with_interactions_is_found(seed):
    random = np.random.default_rng(seed)
    single, pairs = random.normal(size=6), 0.2 * random.normal(size=(6, 6))

    def evaluate(points):
        return points @ single + np.einsum("ni,ij,nj->n", points, pairs, points)

    corners = np.array(list(itertools.product(*((f.low, f.high) for f in FACTORS))))
    worst = find_worst(evaluate, FACTORS, 600)
    assert worst.badness >= evaluate(corners).max() - 1e-12
    assert worst.flights <= 600 and worst.random <= worst.badness
    assert sum(phase.flights for phase in worst.phases) == worst.flights


def test_a_factor_at_whose_other_end_the_metric_is_not_defined_has_no_influence():
    def evaluate(points):
        return np.where(points[:, 1] < 0.0, -math.inf, points[:, 0])

    assert find_worst(evaluate, FACTORS[:2], 20).influences == {"p0": 2.0}


def test_a_time_is_searched_between_its_ends_and_the_search_is_the_same_for_any_budget_that_suffices():
    factors = [*FACTORS[:2], Factor(name="t", unit="s", low=0.0, high=150.0)]
    known = []

    def evaluate(points):
        known.extend(map(tuple, points.tolist()))
        return points[:, 0] + np.exp(-(((points[:, 2] - 2.5) / 4.0) ** 2))

    worst = find_worst(evaluate, factors, 300)
    assert known[worst.flight][2] == pytest.approx(2.5, abs=0.1) and known[worst.flight][0] == 1.0
    assert next(iter(worst.influences)) == "p0" and len(set(known)) == len(known)
    count, first = len(known), list(known)
    known.clear()
    assert find_worst(evaluate, factors, 300) == worst and known == first
    known.clear()
    assert find_worst(evaluate, factors, 40).flights == 40 and known == first[:40] and count <= 300


def test_lost_flights_are_the_worst_and_undefined_metrics_the_least():
    worst = find_worst(lambda p: np.where(p[:, 0] > 0.5, math.inf, p[:, 1]), FACTORS, 60)
    assert worst.badness == math.inf and worst.influences == {}
    assert find_worst(lambda p: np.full(len(p), -math.inf), FACTORS, 60).badness == -math.inf


@pytest.mark.parametrize(
    ("goal", "value"), [("post_fault_attitude_from_nominal", math.radians(0.47393)), ("tube_level", 0.38956)]
)
def test_64_flights_find_the_worst_of_the_1024_corners(goal, value):
    worst = found("case1", goal)
    assert worst.badness == pytest.approx(value, rel=1e-4) and worst.flights == 64
    assert worst.random < worst.badness


def test_the_time_of_the_fault_makes_the_worst_flight_worse():
    worst = found("case1", "post_fault_attitude_from_nominal", 145, factors=ANY_TIME)
    assert math.degrees(worst.badness) == pytest.approx(0.7278, abs=2e-4)
    assert {*list(worst.influences)[:2]} == {"mass", "fault[0].start"}


METRICS = (
    "post_fault_attitude_from_nominal",
    "tube_level",
    "altitude_end_error",
    "elevator_deflection_maximum",
    "altitude_integral_absolute_error",
)


@pytest.mark.long
@pytest.mark.parametrize("name", ["case1", "case2", "winged_cone"])
def test_no_random_flight_of_20000_is_worse(name):
    campaign = plan(name, samples=20_000, seed=11, factors=ANY_TIME)
    runner, numbers = SampleRunner(campaign), range(campaign.samples)
    drawn, _ = campaign.draw(numbers)
    rows = [runner.outcome(flown) for flown in runner.fly_all(numbers, drawn)]
    for goal in METRICS:
        values = np.abs([row[goal] for row in rows if not row["diverged"]])
        worst = found(name, goal, 400, factors=ANY_TIME)
        assert worst.badness >= values.max()
        assert worst.badness >= values[: worst.flights].max()


def test_the_least_budget_suffices_for_signs_corner_and_flips():
    assert least_budget(FACTORS) == 20
    assert find_worst(lambda p: p.sum(axis=1), FACTORS, 20).badness == sum(f.high for f in FACTORS)

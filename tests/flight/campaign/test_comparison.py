"""The comparison of campaigns: pairs, intervals, and what is refused or dropped."""

import math
import subprocess
import sys

import numpy as np
import pytest
from marking import long

import hsv
from hsv.base.errors import CampaignError
from hsv.base.units import UnitSystem
from hsv.flight.campaign.comparison import median_interval
from hsv.pages.comparison import comparison_rows, dropped, latex

SETTINGS = {"samples": 20, "seed": 4, "factor": {"fault[0].effectiveness": (0.2, 0.9)}}
SHORT = {"duration": "40 s", "fault[0].start": "20 s"}


@pytest.fixture(scope="module")
def frames():
    """Return campaigns with and without the tube, in which some flights are lost."""
    cases = {"tube": "case1", "heavy": "case1_integral_heavy"}
    return {label: hsv.montecarlo(hsv.load(name, SHORT), **SETTINGS) for label, name in cases.items()}


def test_pairs_are_the_same_vehicles_and_lost_flights_are_counted(frames):
    tube, heavy = frames.values()
    table = hsv.compare(frames, ["altitude_end_error", "velocity_rise_time"])
    lost = [np.asarray(frame["diverged"]) for frame in (tube, heavy)]
    assert lost[0].any() and not lost[0].all()
    both = ~lost[0] & ~lost[1]
    assert table.attrs["pairs"]["heavy"] == {
        "both_finish": both.sum(),
        "lost_only_here": (lost[1] & ~lost[0]).sum(),
        "lost_only_in_first": (lost[0] & ~lost[1]).sum(),
        "lost_in_both": (lost[0] & lost[1]).sum(),
        "without_partner": 0,
    }
    row = table[(table["metric"] == "altitude_end_error") & (table["campaign"] == "heavy")].iloc[0]
    difference = (heavy["altitude_end_error"].abs() - tube["altitude_end_error"].abs())[both]
    assert row["pairs"] == both.sum() and row["difference"] == pytest.approx(difference.median())
    assert row["low"] <= row["difference"] <= row["high"]
    never = table[table["metric"] == "velocity_rise_time"]  # no flight has this time, so it has no difference
    assert never["median"].tolist() == [math.inf] * 2 and never["pairs"].iloc[1] == 0
    ended = table[table["metric"] == "flown_to_the_end"].iloc[1]
    assert ended["difference"] == pytest.approx(lost[0].mean() - lost[1].mean()) and ended["low"] < ended["high"]


def test_flights_without_a_partner_are_dropped_and_other_seeds_refused(frames):
    fewer = hsv.montecarlo(hsv.load("case1", SHORT), **SETTINGS | {"samples": 12})
    same = hsv.compare({"all": frames["tube"], "fewer": fewer}, ["altitude_end_error"])
    assert same.attrs["pairs"]["fewer"]["without_partner"] == 8
    assert same["difference"].iloc[[1, 3]].tolist() == [0.0, 0.0]
    seed = hsv.montecarlo("case1", 2, seed=5)
    with pytest.raises(CampaignError, match=r"b: seed 5, a has 4; expected the same, which means the same vehicles"):
        hsv.compare({"a": frames["tube"], "b": seed})
    other = hsv.montecarlo("case1", 2, seed=4)
    with pytest.raises(CampaignError, match=r"a, b: no pairs, only one of them varies fault\[0\]\.effectiveness"):
        hsv.compare({"a": frames["tube"], "b": other})
    with pytest.raises(CampaignError, match="metric 'height': not in tube, expected"):
        hsv.compare(frames, ["height"])


def test_the_interval_is_that_of_resampling():
    values = np.sort(np.random.default_rng(3).standard_normal(101))
    drawn = np.median(np.random.default_rng(4).choice(values, (20_000, 101)), axis=1)
    step = np.diff(values).max()
    assert median_interval(values) == pytest.approx(np.percentile(drawn, (2.5, 97.5)), abs=step)


def test_a_table_in_latex_escapes_what_is_special(frames):
    table = hsv.compare({"a_b & 5 %": frames["tube"], "heavy": frames["heavy"]}, ["velocity_rise_time"])
    text = latex(comparison_rows(table, UnitSystem.paper))
    assert r"a\_b \& 5 \%" in text and r"$\infty$" in text
    assert text.count(r"\\") == 1 + len(table) and text.startswith(r"\begin{tabular}{ll")
    assert dropped(table, "a_b & 5 %")[0].startswith("heavy: ")


@long
def test_a_hundred_thousand_flights_are_compared_within_a_gigabyte():
    code = """
import resource, numpy as np, pandas as pd, hsv
small = hsv.montecarlo("case1", 4)
frame = small.loc[np.arange(100_000) % 4].reset_index(drop=True)
frame.attrs = small.attrs | {"vehicles": 100_000}
frame["flight"] = np.arange(100_000)
for column in frame.filter(like="sample_"):
    frame[column] = np.random.default_rng(len(column)).random(100_000)
print(len(hsv.compare({"a": frame, "b": frame.copy()})), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    rows, kilobytes = map(int, done.stdout.split())
    assert rows and kilobytes < 1e6

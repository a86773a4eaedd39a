import math
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from marking import long

from hsv.flight.assembly import flight_parameters
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.claims.evidence import Evidence, shown, worst
from hsv_paper.claims.numbers import FAMILY
from hsv_paper.claims.page import page
from hsv_paper.claims.table import GROUPS, Finding, Reading, Verdict, judge
from hsv_paper.designs import design

CLAIMS = [claim for claims in GROUPS.values() for claim in claims]
PUBLISHED = (Path(__file__).parents[2] / "docs" / "claims.md").read_text(encoding="utf-8")
OVER_VEHICLES = re.compile(r"corner|vehicles|flights")
"""Readings over all vehicles. The tests fly only a few, so the published numbers are at least as unfavourable."""
SLOW = ("the set grows with the disturbances", "the co-designed model conforms")
NOISE = 1e-8
"""Smaller numbers, in the page's units, are rounding errors and differ between processors."""


class Row(NamedTuple):
    """A reading on the page: whether it leads, its numbers in the page's units, and whether it holds."""

    what: str
    leads: bool
    measured: float
    threshold: float
    kept: bool


def number(text):
    """Return the number in a cell such as 'at most 0.5 deg'; infinite without a number, as in 'unbounded'."""
    found = re.search(r"-?\d[\d.]*(e[-+]?\d+)?", text)
    return float(found[0]) if found else math.inf


def published(claim, text=PUBLISHED):
    """Return the verdict on a claim that a page prints, and its rows."""
    section = text.split(f"\n### {claim.name[0].upper()}{claim.name[1:]}\n")[1].split("\n## ")[0].split("\n### ")[0]
    verdict = re.search(r"\. \*\*(.*?)\.\*\*", section)[1].lower()
    cells = [re.split(r"(?<!\\) \| ", line.strip("| ")) for line in section.splitlines() if line.startswith("| ")][2:]
    rows = [
        Row(what.strip("*"), what.startswith("**"), number(measured), number(threshold), kept == "yes")
        for what, *_, measured, threshold, kept in cells
    ]
    return verdict, rows


@pytest.fixture(scope="module")
def evidence():
    """Return evidence on the nominal vehicle and two corners; one is lost with RMPC gains beyond the fourth."""
    over = corners(load_vehicle().uncertainty)
    return Evidence(over=[over[0], over[36], over[-1]])


def finding(*values, leading=1, claim=CLAIMS[0]):
    readings = tuple(Reading(f"reading {i}", value, "1", at_most=1.0) for i, value in enumerate(values))
    return Finding(claim, readings, leading)


def test_the_verdict_follows_from_the_readings():
    assert finding(0.5, 1.0).verdict is Verdict.HOLDS
    assert finding(0.5, 1.1).verdict is Verdict.CONDITIONS
    assert finding(1.1, 0.5).verdict is Verdict.FAILS
    assert finding(0.5, 1.1, 0.5, leading=2).verdict is Verdict.FAILS
    assert finding(0.5, 0.5, 1.1, leading=2).verdict is Verdict.CONDITIONS
    assert finding(math.nan).verdict is Verdict.FAILS
    assert Reading("x", 1.0, "1", at_least=1.0).holds
    assert not Reading("x", 0.9, "1", at_least=1.0).holds


def test_numbers_are_shown_in_the_paper_s_units():
    assert shown(0.3048, "m") == "1 ft"
    assert shown(math.pi / 360.0, "rad") == "0.5 deg"
    assert shown(math.inf, "s") == "not by the end"
    assert shown(math.inf, "1") == "unbounded"
    assert shown(math.nan, "s") == "not defined"
    assert Reading("x", 1.0000312, "1", at_most=1.0).measured() == "1.00003"
    assert Reading("x", 0.9999688, "1", at_most=1.0).measured() == "1"
    assert Reading("x", 0.0, "rad", at_most=math.pi / 360.0).threshold() == "at most 0.5 deg"
    assert Reading("x", 0.0, "dB", at_least=20.0).threshold() == "at least 20 dB"


def test_a_lost_flight_has_no_worst_value():
    assert worst(np.array([1.0, 3.0])) == 3.0
    assert worst(np.array([1.0, np.nan])) == math.inf


@pytest.mark.parametrize(
    "claim", [long(claim) if claim.name in SLOW else claim for claim in CLAIMS], ids=lambda claim: claim.name
)
def test_every_claim_is_measured_and_says_why(claim, evidence):
    result = claim.measure(evidence)
    assert 1 <= result.leading <= len(result.readings)
    assert len(claim.why) > 20
    assert len({(r.what, r.threshold(), r.actuators) for r in result.readings}) == len(result.readings)
    for reading in result.readings:
        # A value that is unbounded, or has not decayed by the end, is infinite and printed as such.
        assert not math.isnan(reading.value), reading.what
    verdict, rows = published(claim)
    assert [row.leads for row in rows] == [i < result.leading for i in range(len(result.readings))]
    for reading, row in zip(result.readings, rows, strict=True):
        assert row.kept == reading.holds or OVER_VEHICLES.search(row.what), row.what
        measured, threshold = number(reading.measured()), number(reading.threshold())
        if not OVER_VEHICLES.search(row.what):
            assert row.measured == pytest.approx(measured, rel=2e-3, abs=NOISE), row.what
            assert row.threshold == pytest.approx(threshold, rel=2e-3, abs=NOISE), row.what
        elif "with notch relative to without" in row.what:
            continue  # a ratio of two worst vehicles, which may change either way with more vehicles
        elif reading.at_most is not None:
            assert row.measured >= measured * (1.0 - math.copysign(2e-3, measured)) - NOISE, row.what
        else:
            assert row.measured <= measured * (1.0 + math.copysign(2e-3, measured)) + NOISE, row.what
    if not any(OVER_VEHICLES.search(row.what) for row in rows):
        assert verdict == result.verdict


def test_the_robust_mpc_that_is_flown_has_the_tightest_gain_that_loses_none(evidence):
    flown = flight_parameters(load_scenario(FAMILY))["robust_mpc.gain_index"]
    gains = range(flown, len(design("baseline").nominal_gains))
    lost = [evidence.corners(FAMILY, ("robust_mpc.gain_index", gain))["diverged"].any() for gain in gains]
    assert not lost[0] and all(lost[1:])


def test_the_page_of_the_docs_holds_these_claims():
    parts = re.findall(r"^### (.*)\n> (.*)\n\n(.*?)\. \*\*.*?\.\*\* (.*)", PUBLISHED, flags=re.MULTILINE)
    assert len(parts) == len(CLAIMS)
    for part, claim in zip(parts, CLAIMS, strict=True):
        assert part[:3] == (claim.name[0].upper() + claim.name[1:], claim.quote, claim.location)
        assert part[3] == claim.why


def test_published_verdicts_follow_from_the_published_readings():
    verdicts = [published(claim)[0] for claim in CLAIMS]
    for claim, verdict in zip(CLAIMS, verdicts, strict=True):
        rows = published(claim)[1]
        kept = [row.kept for row in rows if row.leads], [row.kept for row in rows]
        assert kept[0]
        assert verdict == (
            "does not hold" if not all(kept[0]) else "holds" if all(kept[1]) else "holds under conditions"
        )
        assert f"| {claim.name} | {claim.location} | {verdict} |" in PUBLISHED
    counts = [verdicts.count(verdict) for verdict in Verdict]
    said = "Of {} claims, {} hold, {} hold under conditions, and {} do not hold."
    assert said.format(len(CLAIMS), *counts) in PUBLISHED


@pytest.mark.long
def test_the_page_of_the_docs_is_what_all_vehicles_give():
    text = page(judge(Evidence()))
    for claim in CLAIMS:
        (verdict, rows), (published_verdict, published_rows) = published(claim, text), published(claim)
        assert verdict == published_verdict, claim.name
        assert [row.what for row in rows] == [row.what for row in published_rows]
        for row, other in zip(rows, published_rows, strict=True):
            assert (row.leads, row.threshold, row.kept) == (other.leads, other.threshold, other.kept), row.what
            assert row.measured == pytest.approx(other.measured, rel=2e-3, abs=NOISE), row.what

"""The faults that are tried, and the result that is shipped."""

import re
from pathlib import Path

import pytest

from hsv.flight.resilience.campaign import ResilienceCampaign, plan
from hsv.flight.resilience.faults import RESOLUTION, SEVERITIES, TRIED, Moment
from hsv.flight.resilience.flights import SubjectRunner
from hsv.flight.scenario import parse_scenario


@pytest.fixture(scope="module")
def campaign():
    return plan(("case1",), tuple(TRIED))


def test_at_least_twelve_kinds_are_tried_and_severities_rise():
    assert len({fault.kind for fault in TRIED.values()}) >= 12
    for fault in TRIED.values():
        severities = list(map(fault.severity, fault.values))
        assert severities == sorted(severities) and len(set(severities)) == len(SEVERITIES)
        assert min(severities) >= 0.0 and max(severities) <= 1.0


@pytest.mark.parametrize("name", TRIED)
def test_a_scenario_takes_the_fault_at_every_severity_as_its_only_one(campaign, name):
    [subject], fault = campaign.subjects, TRIED[name]
    for value in (fault.harmless, *fault.values, fault.worst):
        flown = parse_scenario(subject.file(Moment.during, 1, fault, value), "flown")
        [row] = flown.fault
        assert (row.channel, row.type, row.start) == (fault.channel, fault.kind, 30.0)
        assert flown.duration == 130.0 and flown.vehicle.perturbation == subject.vehicles[1]


def test_values_and_severities_are_the_two_sides_of_a_range():
    loss, delay = TRIED["elevator_loss"], TRIED["elevator_delay"]
    assert loss.value(0.0) == 1.0 and loss.value(1.0) == 0.0 and loss.value(loss.severity(0.55)) == pytest.approx(0.55)
    assert loss.resolution == RESOLUTION
    assert delay.value(0.49) == 25.0 and delay.resolution == pytest.approx(1.0 / 49.0)
    slow = TRIED["elevator_rate_limit"]
    assert (slow.value(0.0), slow.value(1.0)) == (100.0, 0.01)
    assert slow.value(0.5) ** 2 == pytest.approx(slow.harmless * slow.worst)  # equal steps are equal ratios
    assert slow.severity(slow.value(0.3)) == pytest.approx(0.3)


def test_a_fault_that_ends_by_itself_stops_after_its_severity(campaign):
    [subject], fault = campaign.subjects, TRIED["elevator_hard_over"]
    [row] = parse_scenario(subject.file(Moment.after, 0, fault, 0.3), "flown").fault
    assert (row.type, row.start, row.stop) == ("hard_over", 100.0, 100.3)


def test_a_campaign_survives_its_own_text(campaign):
    assert ResilienceCampaign.from_text(campaign.text).text == campaign.text
    assert [case.text for case in ResilienceCampaign.from_text(campaign.text).cases] == [
        case.text for case in campaign.cases
    ]


PAGE = Path(__file__).parents[3] / "docs/resilience_result.md"


def rows(heading):
    """Return the rows of the table under a heading: by fault, the entries by controller."""
    section = PAGE.read_text(encoding="utf-8").partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    table = [[entry.strip() for entry in line.strip("|").split("|")] for line in section.splitlines() if "|" in line]
    _, *controllers = table[0]
    faults = {row[0].partition(":")[0].replace(" ", "_"): row[1:] for row in table[2:]}
    return {fault: dict(zip(controllers, entries, strict=True)) for fault, entries in faults.items()}


def test_the_baseline_is_lost_where_the_table_says(campaign):
    runner = SubjectRunner(campaign.subjects[0], Moment.during)
    for name, entries in rows("Largest severity survived").items():
        fault, first = TRIED[name], entries["case1"].split("; ")[0]
        said = float(re.search(r"to (\S+)", first)[1])
        # The table's digits are fewer than the flight's.
        severity = fault.severity(said)
        if first.startswith("all"):
            assert said == pytest.approx(fault.worst) and runner.survives(fault, 1.0)
        else:
            assert runner.survives(fault, severity - 0.005)
            assert not runner.survives(fault, severity + fault.resolution + 0.005)

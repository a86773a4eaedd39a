"""The faults that are tried."""

import pytest

from hsv.base.errors import CampaignError
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


def test_ranges_begin_where_the_baseline_is_not_lost_and_end_where_it_is(campaign):
    # Without any fuel or thrust the airframe still glides for as long as it is watched.
    bearable = {"fuel_loss", "fuel_bandwidth", "thrust_loss"}
    runner = SubjectRunner(campaign.subjects[0], Moment.during)
    assert all(runner.survives(fault, 0.0) for fault in TRIED.values())
    assert {name for name, fault in TRIED.items() if runner.survives(fault, 1.0)} == bearable


def test_corners_are_mirror_images_and_what_solves_in_flight_has_none(campaign):
    nominal, *corners = campaign.subjects[0].vehicles
    assert nominal == {} and len(corners) == 4
    mirrored = [{name: -change for name, change in corner.items()} for corner in corners]
    assert all(image in corners for image in mirrored)
    [solving] = plan(("case1_qp",), ("elevator_loss",)).subjects
    assert solving.vehicles == ({},)


def test_a_campaign_survives_its_own_text(campaign):
    assert ResilienceCampaign.from_text(campaign.text).text == campaign.text
    assert [case.text for case in ResilienceCampaign.from_text(campaign.text).cases] == [
        case.text for case in campaign.cases
    ]


@pytest.mark.parametrize(
    ("controllers", "faults", "expected"),
    [
        ((), ("elevator_loss",), "controllers: none"),
        (("case1", "case1"), ("elevator_loss",), "controllers: 'case1' twice"),
        (("case1",), ("elevator_lost",), "faults = 'elevator_lost': expected one of elevator_loss, "),
    ],
)
def test_what_cannot_be_planned_is_named(controllers, faults, expected):
    with pytest.raises(CampaignError, match=expected):
        plan(controllers, faults)

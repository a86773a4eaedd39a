"""The faults of resilience campaigns, complete campaigns, and the shipped result."""

import re
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from node_processes import short_scenario

from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.fingerprint import drop_older
from hsv.flight.history import History
from hsv.flight.metrics import FlightData
from hsv.flight.resilience.campaign import ResilienceCampaign, plan
from hsv.flight.resilience.faults import RESOLUTION, SEVERITIES, TRIED, Moment
from hsv.flight.resilience.flights import ALTITUDE_BAND, ATTITUDE_BAND, Boundary, SubjectRunner, boundary, distances
from hsv.flight.resilience.summary import CaseStore
from hsv.flight.scenario import parse_scenario

FAULTS = ("elevator_loss", "pitch_rate_drop_out")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return plan((str(short_scenario(tmp_path_factory.mktemp("scenario"), duration=6, fault=2)),), FAULTS)


def kept(store):
    return {path.name: path.read_bytes() for path in store.folder.glob("*.json")}


@pytest.fixture(scope="module")
def whole(campaign, tmp_path_factory):
    """Return the result of the campaign, flown in this process without disturbance."""
    store = CaseStore(tmp_path_factory.mktemp("whole"), campaign)
    assert run_campaign(campaign, store, Executor()).batches == len(campaign.batches)
    return kept(store)


def test_interrupted_it_goes_on_where_it_was(campaign, whole, tmp_path):
    store, seen = CaseStore(tmp_path, campaign), []

    def interrupt(done):
        seen.append(done)
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_campaign(campaign, store, Executor(), progress=interrupt)
    [first] = store.folder.glob("*.json")
    written = first.stat().st_mtime_ns
    assert seen == [0, campaign.batches[0].flights]
    assert run_campaign(campaign, store, Executor()).batches == len(campaign.batches) - 1
    assert first.stat().st_mtime_ns == written and kept(store) == whole


def test_a_damaged_case_is_flown_anew(campaign, whole, tmp_path):
    store = CaseStore(tmp_path, campaign)
    store.folder.mkdir()
    for name, content in whole.items():
        store.folder.joinpath(name).write_bytes(content)
    first = min(store.folder.glob("*.json"))
    first.write_text(first.read_text()[:-20])
    assert run_campaign(campaign, store, Executor()).batches == 1 and kept(store) == whole


def test_only_the_newest_cases_of_a_campaign_are_kept(tmp_path):
    new, old = "0123456789ab", "ba9876543210"
    for name in (f"case1_{new}", f"case1_{old}", f"case1_no_notch_{old}"):
        (tmp_path / name).mkdir()
    drop_older(tmp_path / f"case1_{new}")
    assert {path.name for path in tmp_path.iterdir()} == {f"case1_{new}", f"case1_no_notch_{old}"}


@pytest.mark.parametrize("limit", [0.003, 0.31, 0.5, 0.99])
@pytest.mark.parametrize("fault", [TRIED["elevator_loss"], TRIED["elevator_delay"]])
def test_bisection_encloses_a_threshold(fault, limit):
    def survives(severity):
        return severity < limit

    known = {severity: survives(severity) for severity in map(fault.severity, fault.values)}
    found = boundary(fault, survives, known)
    assert found.survived < limit <= found.lost and found.lost - found.survived <= fault.resolution + 1e-9


def test_the_ends_of_a_range_may_be_survived_or_lost():
    fault = TRIED["elevator_loss"]
    assert boundary(fault, lambda severity: True, {0.2: True}) == Boundary(1.0, None)
    assert boundary(fault, lambda severity: False, {0.2: False}) == Boundary(None, 0.0)


def flight(altitude, attitude):
    """Return a flight with one step per second, at rest except for altitude (m) and pitch angle (rad)."""
    n = len(altitude)
    state = np.zeros((n, 9))
    state[:, 0], state[:, 3] = altitude, attitude
    return FlightData(np.arange(float(n)), History.of(state=state), np.zeros((n, 9)), 2.0)


def test_recovery_is_the_last_exit_from_the_band():
    still, apart = flight(np.zeros(10), np.zeros(10)), np.zeros(10)
    apart[[1, 3, 5]] = 2.0 * ALTITUDE_BAND
    attitude, altitude, recovery = distances(flight(apart, np.zeros(10)), still, 2.0)
    assert (attitude, altitude, recovery) == (0.0, 2.0 * ALTITUDE_BAND, 4.0)
    apart[9] = 2.0 * ALTITUDE_BAND
    assert distances(flight(apart, np.zeros(10)), still, 2.0)[2] is None
    tilted = flight(np.zeros(10), np.full(10, 0.9 * ATTITUDE_BAND))
    assert distances(tilted, still, 2.0) == (pytest.approx(0.9 * ATTITUDE_BAND), 0.0, 0.0)
    # A flight that ends early is compared up to its end.
    assert distances(flight(np.zeros(6), np.linspace(0.0, 1.0, 6)), still, 2.0) == (1.0, 0.0, None)


def test_a_fault_without_effect_leaves_the_flight_where_it_is():
    campaign, fault = plan(("case1",), ("elevator_loss",)), TRIED["elevator_loss"]
    runner = SubjectRunner(campaign.subjects[0], Moment.during)
    flown = runner.outcome("mild", 2, fault, 1.0)
    assert (flown.survived, flown.attitude, flown.altitude, flown.recovery_time) == (True, 0.0, 0.0, 0.0)
    lost = runner.outcome("severe", 0, fault, 0.0)
    assert not lost.survived and 0.0 < lost.time_to_loss < 10.0 and lost.recovery_time is None


def test_a_scenario_with_requirements_on_its_fault_is_flown_without_them(tmp_path):
    row = {"name": "a", "signal": "altitude_error", "at_most": "9 m", "always": True, "from": "fault"}
    file = tmp_path / "required.toml"
    file.write_text(tomli_w.dumps({"extends": "case1", "title": "required", "requirement": [row]}), encoding="utf-8")
    [subject] = plan((str(file),), ("elevator_loss",)).subjects
    assert subject.scenario.requirement and not parse_scenario(subject.file(Moment.during, 0), "flown").requirement


@pytest.fixture(scope="module")
def all_faults():
    return plan(("case1",), tuple(TRIED))


def test_at_least_twelve_kinds_are_tried_and_severities_rise():
    assert len({fault.kind for fault in TRIED.values()}) >= 12
    for fault in TRIED.values():
        severities = list(map(fault.severity, fault.values))
        assert severities == sorted(severities) and len(set(severities)) == len(SEVERITIES)
        assert min(severities) >= 0.0 and max(severities) <= 1.0


@pytest.mark.parametrize("name", TRIED)
def test_a_scenario_takes_the_fault_at_every_severity_as_its_only_one(all_faults, name):
    [subject], fault = all_faults.subjects, TRIED[name]
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
    assert slow.value(0.5) ** 2 == pytest.approx(slow.harmless * slow.worst)  # equal steps of severity are equal ratios
    assert slow.severity(slow.value(0.3)) == pytest.approx(0.3)


def test_a_fault_that_ends_by_itself_stops_after_its_severity(all_faults):
    [subject], fault = all_faults.subjects, TRIED["elevator_hard_over"]
    [row] = parse_scenario(subject.file(Moment.after, 0, fault, 0.3), "flown").fault
    assert (row.type, row.start, row.stop) == ("hard_over", 100.0, 100.3)


def test_a_campaign_survives_its_own_text(all_faults):
    assert ResilienceCampaign.from_text(all_faults.text).text == all_faults.text
    assert [case.text for case in ResilienceCampaign.from_text(all_faults.text).cases] == [
        case.text for case in all_faults.cases
    ]


PAGE = Path(__file__).parents[3] / "docs/resilience_result.md"


def rows(heading):
    """Return the rows of the table under a heading: entries by controller, by fault."""
    section = PAGE.read_text(encoding="utf-8").partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    table = [[entry.strip() for entry in line.strip("|").split("|")] for line in section.splitlines() if "|" in line]
    _, *controllers = table[0]
    faults = {row[0].partition(":")[0].replace(" ", "_"): row[1:] for row in table[2:]}
    return {fault: dict(zip(controllers, entries, strict=True)) for fault, entries in faults.items()}


def test_the_baseline_is_lost_where_the_table_says(all_faults):
    runner = SubjectRunner(all_faults.subjects[0], Moment.during)

    def survives(fault, severity):
        return runner.outcome("", 0, fault, fault.value(severity)).survived

    for name, entries in rows("Largest severity survived").items():
        fault, first = TRIED[name], entries["case1"].split("; ")[0]
        said = float(re.search(r"to (\S+)", first)[1])
        # The table's severities are rounded.
        severity = fault.severity(said)
        if first.startswith("survives all"):
            assert said == pytest.approx(fault.worst) and survives(fault, 1.0)
        else:
            assert survives(fault, severity - 0.005)
            assert not survives(fault, severity + fault.resolution + 0.005)

import pytest

from hsv.base.errors import DesignError
from hsv.design.verification.scenario import bounding_corners, scenario_checks
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text


def test_a_flight_of_the_declared_region_keeps_to_the_certificate(subject):
    checks = list(scenario_checks(subject, load_scenario("case1"), bounding_corners(subject)))
    assert [check.ok for check in checks] == [True] * 3
    assert 0.0 < checks[0].value <= subject.certificate["tube"]["flights"]["worst_level"] * (1 + 1e-6)


def test_a_fault_beyond_the_region_is_found_outside(subject):
    scenario = parse_scenario(scenario_text("case1").replace("effectiveness = 0.9", "effectiveness = 0.7"), "worse")
    _, disturbance, room = scenario_checks(subject, scenario)
    assert not disturbance.ok and disturbance.value > 2.0 and "lost_elevator" in disturbance.name
    assert room.ok


def test_without_a_tube_there_is_nothing_to_check(subject):
    with pytest.raises(DesignError, match="controller = 'robust_mpc', expected 'tube_mpc'"):
        list(scenario_checks(subject, load_scenario("case1_rmpc")))

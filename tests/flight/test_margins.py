"""Borders of stability: flights on both sides of the computed ones; and which scenarios have no margins, and why."""

import control
import numpy as np
import pytest

from hsv.base.errors import QuantityError, ScenarioError
from hsv.certificate.margins import classical_margins
from hsv.control.design_file import find_certificate, find_design, read_certificate, read_design
from hsv.flight.assembly import flight_parameters
from hsv.flight.margins import corner_file, flown_borders, loop, margin_verdict, scenario_loops
from hsv.flight.scenario import load_scenario, parse_scenario


@pytest.mark.parametrize("name", ["case1", "case1_tight", "case1_robust", "winged_cone", "case1_realistic"])
def test_flights_lose_stability_where_the_loop_does(name):
    scenario = load_scenario(name)
    design = read_design(find_design(scenario.design))
    borders = flown_borders(flight_parameters(scenario), design, scenario_loops(scenario))
    assert [border.kind for border in borders] == ["gain up", "gain down", "delay"]
    for border in borders:
        inside, outside = border.flown_growth
        assert inside < 0.0 < outside, border
        assert border.flown_frequency == pytest.approx(border.frequency, rel=0.05)


@pytest.mark.parametrize(
    ("name", "changes", "reason"),
    [
        ("case1_rmpc", {}, "controller = 'robust_mpc'"),
        ("case1_qp", {}, "nominal.law = 'qp': solved in flight"),
        ("case2", {}, "tau"),
        ("case1_active", {}, "effectiveness"),
        ("case1_integral_heavy", {}, "integral"),
        ("case1", {"estimator.enabled": True}, "estimator"),
        ("case1", {"link.command.jitter": 2}, "link: random jitter"),
        ("case1", {"controller": "node:lqr", "design": ""}, "design = ''"),
    ],
)
def test_no_margins_of_another_loop_are_given(name, changes, reason):
    with pytest.raises(ScenarioError, match="no margins: ") as refused:
        scenario_loops(load_scenario(name, changes))
    assert reason in str(refused.value)


def test_hardware_and_delay_of_the_scenario_are_in_the_loop():
    delays = ("0 ms", "30 ms")
    plain, late = (scenario_loops(load_scenario("case1_realistic", {"link.computational_delay": d})) for d in delays)
    assert [actuator.natural_frequency for actuator in plain.feedback.hardware.actuators] == [10.0, 50.0]
    assert late.feedback.hardware.delay == pytest.approx(plain.feedback.hardware.delay + 0.03)
    assert late.loop("", "start").growth > plain.loop("", "start").growth


def test_a_corner_is_a_scenario():
    scenario = load_scenario("case1_robust")
    around = scenario_loops(scenario)
    corner = parse_scenario(corner_file(scenario, around, "-+-----++-"), "corner")
    assert corner.vehicle.perturbation == pytest.approx(around.changes("-+-----++-"))


def test_a_required_disk_margin_is_judged_by_the_certificate():
    design, scenario = read_design(find_design("robust")), load_scenario("case1_robust")
    assert margin_verdict(scenario, design) == {"kept": True, "words": "disk margin at the vertices 0.900 (limit 0.85)"}
    missed = margin_verdict(load_scenario("case1_robust", {"limits.disk_margin": 0.95}), design)
    assert missed == {"kept": False, "words": "disk margin at the vertices 0.900 violated (limit 0.95)"}
    assert margin_verdict(load_scenario("case1"), design) is None
    unknown = {"kept": None, "words": "disk margin not judged: hsv margins case1_robust"}
    other = read_certificate(find_certificate("tight"))  # margins above those of this design, and a block without any
    other["margins"]["vertices"]["elevator"]["margin"] = [0.99] * len(design.polytope.A)
    for certificate in ({}, {"margins": {"vertices": {"elevator": {}}}}, {"margins": None}, other):
        assert margin_verdict(scenario, design, certificate) == unknown
    solved = load_scenario("case1_qp", {"limits.disk_margin": 0.5})
    assert margin_verdict(solved, design)["words"] == "disk margin not judged: hsv margins case1_qp"


@pytest.mark.parametrize("at", ["elevator", "fuel", "both", "pitch_rate", "altitude"])
def test_the_loop_of_a_scenario_is_a_state_space_of_python_control(at):
    around = scenario_loops(load_scenario("case1_realistic", {"link.computational_delay": "30 ms"}))
    own = loop("", load_scenario("case1_realistic", {"link.computational_delay": "30 ms"}), at=at)
    L, sampled = own.to_control(), around.loop("", "start")
    closed = control.feedback(L, np.eye(len(own.signals)))
    np.testing.assert_allclose(closed.A, sampled.closed, atol=1e-9)
    assert len(own.states) == len(L.A) and own.states[-1] == "filter_2" and "elevator_deflection_before_2" in own.states
    if at != "both":
        assert L(np.exp(1j * 4.0 * own.period)) == pytest.approx(sampled.broken(at).transfer(4.0), rel=1e-6)


def test_margins_of_the_loop_are_those_of_hsv_margins():
    own = loop("robust", altitude="86000 ft", velocity="7800 ft/s")
    margins = classical_margins(scenario_loops(load_scenario("case1_robust")).loop("", "start").broken("elevator"))
    theirs = control.stability_margins(loop("robust").to_control(), returnall=True, method="frd")[0]
    for border in (margins.gain_up, margins.gain_down):
        assert min(abs(theirs / border - 1.0)) < 0.01
    assert own.signals == ("elevator_deflection",) and not np.array_equal(own.A, loop("robust").A)
    with pytest.raises(QuantityError, match=r"^at = 'rudder': expected one of fuel, elevator"):
        loop(at="rudder")

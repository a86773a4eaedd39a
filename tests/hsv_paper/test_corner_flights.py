import numpy as np
import pytest

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.corner_flights import fly_over
from hsv_paper.linear_loop import phase_margins, sampled_loop

HALF_WIDTH = np.ones(5)


def short(scenario):
    return {**flight_parameters(load_scenario(scenario)), "duration": 4.0, "fault.starts": [1.0]}


def test_a_table_has_a_row_for_every_vehicle_in_order():
    over = corners(load_vehicle().uncertainty)[:4]
    table = fly_over(short("case1"), over, HALF_WIDTH)
    parts = assemble(short("case1"))
    for index, corner in enumerate(over):
        flight = fly(parts.perturbed(corner)).data()
        assert table["altitude_end_error"][index] == flight.state[-1, 0] - flight.reference[-1, 0]
    assert not table["diverged"].any()


def test_coupling_is_scaled_from_the_derived_set():
    derived = {**short("case1"), "vehicle.coupling": "derived"}
    named = fly_over(derived, [{}], HALF_WIDTH)
    scaled = fly_over(short("case1") | {"vehicle.coupling": "1.0"}, [{}], HALF_WIDTH)
    assert scaled["elevator_deflection_maximum"] == named["elevator_deflection_maximum"]


def test_the_sampled_loop_agrees_with_the_flights_on_who_is_stable():
    from hsv_paper.claims.evidence import Design

    flown = Design("baseline").flown
    growth = {
        (coupling, bool(notch)): sampled_loop(
            load_vehicle().coupled(coupling), flown.feedback_gain, notch, flown.period
        ).growth
        for coupling in ("paper_like", "derived")
        for notch in ((), flown.notch)
    }
    assert growth["paper_like", True] == pytest.approx(-0.293, abs=2e-3)
    assert -0.01 < growth["paper_like", False] < 0.0
    assert growth["derived", True] < -0.15
    assert growth["derived", False] > 1.0


def test_phase_margin_of_an_integrator_is_a_right_angle():
    frequencies = np.logspace(-2, 2, 2000)
    [margin] = phase_margins(frequencies, 1.0 / (1j * frequencies))
    assert margin.frequency == pytest.approx(1.0, rel=1e-3)
    assert margin.phase == pytest.approx(np.pi / 2)

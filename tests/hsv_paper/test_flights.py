from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Point, fly_over


def short(**changes):
    values = {**flight_parameters(load_scenario("case1")), "duration": 4.0, "fault.starts": [1.0]}
    return values | {name.replace("__", "."): value for name, value in changes.items()}


def test_a_table_has_a_row_for_every_vehicle_in_order():
    over = corners(load_vehicle().uncertainty)[:4]
    table = fly_over(Point(short(), over))
    parts = assemble(short())
    for index, corner in enumerate(over):
        flight = fly(parts.perturbed(corner))
        assert table["altitude_end_error"][index] == flight.history.state[-1, 0] - flight.reference[-1, 0]
    assert not table["diverged"].any()


def test_coupling_is_scaled_from_the_derived_set():
    named, scaled = (fly_over(Point(short(vehicle__coupling=name), [{}])) for name in ("derived", "1.0"))
    assert scaled["elevator_deflection_maximum"] == named["elevator_deflection_maximum"]

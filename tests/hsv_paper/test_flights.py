import numpy as np

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.flights import Flights, Point, fly_over


def short(**changes):
    values = {**flight_parameters(load_scenario("case1")), "duration": 4.0, "fault.starts": [1.0]}
    return values | {name.replace("__", "."): value for name, value in changes.items()}


def test_a_table_has_a_row_for_every_vehicle_in_order():
    over = corners(load_vehicle().uncertainty)[:4]
    table = fly_over(Point(short(), over))
    parts = assemble(short())
    for index, corner in enumerate(over):
        flight = fly(parts.perturbed(corner)).data()
        assert table["altitude_end_error"][index] == flight.state[-1, 0] - flight.reference[-1, 0]
    assert not table["diverged"].any()


def test_coupling_is_scaled_from_the_derived_set():
    named, scaled = (fly_over(Point(short(vehicle__coupling=name), [{}])) for name in ("derived", "1.0"))
    assert scaled["elevator_deflection_maximum"] == named["elevator_deflection_maximum"]


def test_tables_are_flown_once_and_found_again(tmp_path):
    progress = []
    flights = Flights(tmp_path, lambda *what: progress.append(what))
    points = [Point(short(vehicle__coupling=kappa), [{}, {"mass": 0.1}]) for kappa in ("0.0", "0.25")]
    flown = flights.tables("a sweep", points)
    count = len(progress)
    again = flights.tables("a sweep", points)
    assert len(progress) == count
    for table, other in zip(flown, again, strict=True):
        assert table.keys() == other.keys()
        assert all(np.array_equal(table[name], other[name], equal_nan=True) for name in table)
    # Other points replace what is kept under this name.
    [other] = flights.tables("a sweep", points[1:])
    assert np.array_equal(other["altitude_end_error"], flown[1]["altitude_end_error"])
    assert len(list(tmp_path.iterdir())) == 1

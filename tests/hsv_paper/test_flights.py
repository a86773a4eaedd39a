import numpy as np

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv_paper.flights import Flights


def test_a_flight_in_process_is_flown_once_and_not_kept(tmp_path):
    flights = Flights(tmp_path / "flights", graph=False)
    flight = flights["case1"]
    assert flights["case1"] is flight
    assert not list(tmp_path.iterdir())
    again = fly(assemble(flight_parameters(load_scenario("case1")))).data()
    for name in ("state", "reference", "deviation", "command", "saturated", "gain_index"):
        assert np.array_equal(getattr(flight, name), getattr(again, name)), name
    assert flight.fault_start == again.fault_start
    assert np.abs(flight.time - again.time).max() < 1e-9

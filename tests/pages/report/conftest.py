"""Flights recorded in this process."""

import pytest
from recorded_flight import record_flight

from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import load_scenario


@pytest.fixture(scope="session")
def bags(tmp_path_factory):
    return tmp_path_factory.mktemp("bags")


@pytest.fixture(scope="session")
def quiet(bags):
    """Return a flight whose only event is the fault."""
    return record_flight(bags / "quiet")


@pytest.fixture(scope="session")
def loud(bags, quiet):
    """Return a flight with too little fuel and too small a set: limited commands, errors outside the tube, warnings."""
    design = flight_parameters(load_scenario("case1"))
    level = quiet.columns("/hsv/tube_status")["level"]
    shrunk = 2.0 / float(level.min() + level.max())
    return record_flight(
        bags / "loud",
        log=((0.0, 20, "all is well"), (3.0, 30, "<b>unusual</b>"), (4.0, 30, "<b>unusual</b>"), (9.0, 40, "worse")),
        input__maximum=[0.49, 0.5235987755982988],
        tube__shape=[shrunk * number for number in design["tube.shape"]],
        tube__half_width=[number / shrunk**0.5 for number in design["tube.half_width"]],
    )

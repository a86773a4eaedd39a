"""Fill the compiled caches once, so that nodes starting together do not all compile: ``python -m hsv.warm``."""

from __future__ import annotations

from hsv.sha256_lanes import digests
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.blocks import steps
from hsv.simulation.closed_loop import fly
from hsv.simulation.scenario import load_scenario
from hsv.simulation.side_by_side import FlightGroup


def warm() -> None:
    """Step every component and fly every compiled loop once."""
    for name in ("case1", "case1_active", "case1_realistic", "case1_hard_sensors"):
        components = assemble(flight_parameters(load_scenario(name)) | {"duration": 0.1})
        fly(components)
        for _ in steps(components):
            pass
    both = [assemble(flight_parameters(load_scenario("case1")) | {"duration": 0.1}) for _ in range(2)]
    flown = FlightGroup(both[0].plant.steps).fly(both).flights
    digests([flight.history.flown for flight in flown])


if __name__ == "__main__":
    warm()

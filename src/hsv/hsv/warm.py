"""Fill the compiled caches once, so that nodes starting together do not all compile: ``python -m hsv.warm``."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hsv.sha256_lanes import LANES
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.blocks import steps
from hsv.simulation.closed_loop import fly
from hsv.simulation.fingerprint import fingerprints
from hsv.simulation.metrics import flight_metrics
from hsv.simulation.scenario import load_scenario
from hsv.simulation.side_by_side import FlightGroup


def warm() -> None:
    """Step every component and fly every compiled loop once."""
    for name in ("case1", "case1_active", "case1_realistic", "case1_hard_sensors"):
        components = assemble(flight_parameters(load_scenario(name)) | {"duration": 0.1})
        flown = fly(components).data()
        flight_metrics(flown)
        columns: dict[str, Any] = {
            name: value.copy() for name, value in vars(flown).items() if isinstance(value, np.ndarray)
        }
        flight_metrics(replace(flown, **columns))  # as they come from a bag, each on its own
        for _ in steps(components):
            pass
    both = [assemble(flight_parameters(load_scenario("case1")) | {"duration": 0.1}) for _ in range(2)]
    group = FlightGroup(both[0].plant.steps).fly(both)
    fingerprints([group.flights[0].history.flown] * LANES)


if __name__ == "__main__":
    warm()

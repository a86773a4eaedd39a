"""Fill the compiled caches once, so that nodes starting together do not all compile: ``python -m hsv.warm``."""

from __future__ import annotations

import numpy as np

from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.closed_loop import controller_input, fly
from hsv.simulation.scenario import load_scenario


def warm() -> None:
    """Step every component and fly every compiled loop once."""
    components = assemble(flight_parameters(load_scenario("case1")) | {"duration": 0.1})
    fly(components)
    state = components.plant.reset()
    filtered = components.notch_filter.step(float(state.state[4]))
    nominal = components.nominal_trajectory.step(state.state)
    answer = components.controller.step(controller_input(0, state.state, filtered, nominal))
    actuator = components.fault_injector.step(0, answer.input).actuator
    components.plant.step(np.asarray(actuator))


if __name__ == "__main__":
    warm()

"""A design that knows its actuators: their states in the error system."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.design.disturbance import ChannelModel, DisturbanceSet
from hsv.design.inputs import ActuatorInputs, parse_inputs
from hsv.design.region import Region
from hsv.design.tube_problem import tube_problem

NAMES = ("fuel_10", "elevator_50")


@pytest.fixture(scope="module")
def design(subject):
    return dataclasses.replace(subject.design, actuators=NAMES)


@pytest.fixture(scope="module")
def flight(design, subject):
    short = subject.inputs.disturbance.model_copy(update={"duration": 102.0})
    actuator = {"fuel_equivalence_ratio": NAMES[0], "elevator_deflection": NAMES[1]}
    table = subject.inputs.model_copy(update={"disturbance": short, "actuator": ActuatorInputs(**actuator)})
    return Region(design, table, 1.0).fly(subject.vehicle.uncertainty)


def test_the_error_system_predicts_the_error_of_a_flight_with_actuators(flight, design, subject):
    """From one step to the next, states of filter and actuators included; the lag of the plan is taken out before."""
    model = ChannelModel(design, subject.vehicle)
    errors, _ = model.errors(flight)
    channels = model.signals(flight).channels
    ones = DisturbanceSet(-np.ones(7), np.ones(7))
    size = np.abs(errors).max(axis=0)
    for k in (1, 60, 700, 5001, 5090):
        A, B = design.polytope.at(*flight.history.state[k, :2])
        local = dataclasses.replace(design.polytope, A=np.repeat(A[None], 20, 0), B=np.repeat(B[None], 20, 0))
        system = tube_problem(dataclasses.replace(design, polytope=local), subject.vehicle, ones).system
        predicted = system.A[0] @ errors[k] + system.G[0] @ channels[k]
        assert_allclose(predicted / size, errors[k + 1] / size, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("name", "table", "message"),
    [
        ("adjustable", {"elevator_deflection": "elevator_50"}, r"^actuator: given, expected none in an adjustable"),
        ("baseline", {"elevator_deflection": "fuel_10"}, r"actuator\.elevator_deflection = 'fuel_10': expected one of"),
        ("baseline", {"rudder": "elevator_50"}, r"actuator\.rudder: unknown field"),
    ],
)
def test_wrong_actuators_are_named(name, table, message):
    source = Path(__file__).parents[2] / "offline_design" / f"{name}.toml"
    inputs = tomllib.loads(source.read_text(encoding="utf-8"))
    with pytest.raises(DesignError, match=message):
        parse_inputs(inputs | {"actuator": table})

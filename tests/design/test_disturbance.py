"""Disturbances of flights by channel, and the error system that they drive, with actuators."""

import dataclasses
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.base.errors import DesignError
from hsv.design.disturbance import ChannelModel, DisturbanceSet, widened
from hsv.design.inputs import ActuatorInputs, parse_inputs
from hsv.design.region import Region
from hsv.design.tube_problem import tube_problem
from hsv.model.vehicle import load_vehicle


@pytest.fixture(scope="module")
def flight(subject):
    inputs = subject.inputs
    short = inputs.disturbance.model_copy(update={"duration": 104.0})
    worst = dict(load_vehicle().uncertainty)
    return Region(subject.design, inputs.model_copy(update={"disturbance": short}), 1.0).fly(worst)


def test_channels_rebuild_the_disturbance_of_the_rigid_states(flight, subject):
    model = ChannelModel(subject.design, subject.vehicle)
    signals = model.signals(flight)
    a, lost, rest = signals.channels[:, :3], signals.channels[:, 3], signals.channels[:, 5:]
    for k in (0, 100, 4999, 5000, 5150):
        x = flight.history.state[k]
        _, B = subject.design.polytope.at(x[0], x[1])
        rebuilt = model.columns @ a[k] + B[:5, 1] * lost[k]
        rebuilt[[0, 3]] += rest[k]
        assert_allclose(rebuilt, signals.delta[k, :5], rtol=0.0, atol=1e-13)
        assert_allclose(signals.remainder[k] + signals.fault[k], signals.delta[k], rtol=0.0, atol=1e-15)


def test_membership_names_channel_and_step():
    low, high = np.array([-1.0] * 3 + [-0.2] + [-1.0] * 3), np.array([2.0] * 3 + [0.0] + [1.0] * 3)
    bounds = DisturbanceSet(*widened(low, high, 1.1))
    channels = np.zeros((5, 7))
    assert bounds.membership(channels).ratio == 0.0
    channels[3, 1] = 3.3
    worst = bounds.membership(channels)
    assert (worst.channel, worst.step, worst.inside) == ("angle_of_attack_rate", 3, False)
    assert worst.ratio == pytest.approx(1.5)
    channels[4, 3] = 1e-6
    assert bounds.membership(channels).channel == "lost_elevator"


NAMES = ("fuel_10", "elevator_50")


@pytest.fixture(scope="module")
def design(subject):
    return dataclasses.replace(subject.design, actuators=NAMES)


@pytest.fixture(scope="module")
def actuated_flight(design, subject):
    short = subject.inputs.disturbance.model_copy(update={"duration": 102.0})
    actuator = {"fuel_equivalence_ratio": NAMES[0], "elevator_deflection": NAMES[1]}
    table = subject.inputs.model_copy(update={"disturbance": short, "actuator": ActuatorInputs(**actuator)})
    return Region(design, table, 1.0).fly(subject.vehicle.uncertainty)


def test_the_error_system_predicts_the_error_of_a_flight_with_actuators(actuated_flight, design, subject):
    """One step ahead, including the states of filter and actuators, after the lag of the plan is removed."""
    model = ChannelModel(design, subject.vehicle)
    errors, _ = model.errors(actuated_flight)
    channels = model.signals(actuated_flight).channels
    ones = DisturbanceSet(-np.ones(7), np.ones(7))
    size = np.abs(errors).max(axis=0)
    for k in (1, 60, 700, 5001, 5090):
        A, B = design.polytope.at(*actuated_flight.history.state[k, :2])
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

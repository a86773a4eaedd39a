"""Disturbances of flights by channel drive the error system of the verification, also with actuators."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.certificate.verification import error_system
from hsv.design.certified import load_certified
from hsv.design.inputs import ActuatorInputs
from hsv.design.region import Region
from hsv.flight.disturbance import ChannelModel, membership

ACTUATORS = {"fuel_equivalence_ratio": "fuel_10", "elevator_deflection": "elevator_50"}


@pytest.fixture(scope="module")
def subject():
    return load_certified(Path(__file__).parents[2] / "offline_design" / "baseline.yaml")


@pytest.mark.parametrize("actuators", [{}, ACTUATORS], ids=["ideal", "actuated"])
def test_disturbances_predict_the_error_of_each_step_after_the_lag_of_the_plan_is_removed(subject, actuators):
    design, vehicle = dataclasses.replace(subject.design, actuators=tuple(actuators.values())), subject.vehicle
    short = subject.inputs.disturbance.model_copy(update={"duration": 102.0})
    table = subject.inputs.model_copy(update={"disturbance": short, "actuator": ActuatorInputs(**actuators)})
    flight, model = Region(design, table, 1.0).fly(vehicle.uncertainty), ChannelModel(design, vehicle)
    channels, (errors, lag) = model.channels(flight), model.errors(flight)
    assert lag.any() == bool(actuators)
    size = np.abs(errors).max(axis=0)
    for k in (1, 60, 700, 4999, 5000, 5001, 5090):
        A, B = design.polytope.at(*flight.history.state[k, :2])
        local = dataclasses.replace(design.polytope, A=np.repeat(A[None], 20, 0), B=np.repeat(B[None], 20, 0))
        system = error_system(dataclasses.replace(design, polytope=local), vehicle, np.ones(5))
        predicted = system.A[0] @ errors[k] + system.G[0] @ channels[k]
        assert_allclose(predicted / size, errors[k + 1] / size, rtol=0.0, atol=1e-8)


def test_membership_names_channel_and_step():
    bounds = np.array([-1.1] * 3 + [-0.22] + [-1.1] * 3), np.array([2.2] * 3 + [0.0] + [1.1] * 3)
    channels = np.zeros((5, 7))
    assert membership(channels, *bounds).ratio == 0.0
    channels[3, 1] = 3.3
    worst = membership(channels, *bounds)
    assert (worst.channel, worst.step, worst.ratio) == ("angle_of_attack_rate", 3, pytest.approx(1.5))
    channels[4, 3] = 1e-6
    assert membership(channels, *bounds).channel == "lost_elevator"

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.design.disturbance import ChannelModel, DisturbanceSet, widened
from hsv.design.region import Region
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

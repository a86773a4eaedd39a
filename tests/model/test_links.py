"""Links: exact delays, computation time, loss rates and lengths of loss bursts."""

import math

import numpy as np
import pytest
from core_calls import receive
from numpy.testing import assert_array_equal

from hsv.base.errors import ParameterError
from hsv.model.links import command_link, computation, link_state, measurement_link

T = 0.02
STEPS = 4000
SENT = np.array([26000.0, 2400.0, 0.03, 0.04, 0.01, 1.0, 2.0, 0.3, 0.4]) * (
    1.0 + 0.1 * np.sin(np.outer(np.arange(STEPS), np.linspace(0.11, 0.27, 9)))
)


def passed(link, sent=SENT, seed=0, before=None):
    """Return what the receiver has in every step of the payloads ``sent``."""
    state = link_state(link, sent.shape[1], before)
    return np.array([receive(link, state, k, seed, payload) for k, payload in enumerate(sent)])


def measured(sent=SENT, seed=0, **fields):
    return passed(measurement_link({f"link.measurement.{name}": value for name, value in fields.items()}), sent, seed)


def held(taken):
    return np.array([False, *(taken[1:] == taken[:-1]).all(axis=1)])


@pytest.mark.parametrize("delay", [1, 3, 50])
def test_delay_is_exact(delay):
    assert_array_equal(measured(delay=float(delay)), SENT[np.maximum(np.arange(STEPS) - delay, 0)])


@pytest.mark.parametrize(("delay", "computed", "steps"), [(0.0, 0.02, 1), (2.0, 0.0, 2), (1.0, 0.065, 4)])
def test_a_delayed_command_follows_that_of_the_trim(delay, computed, steps):
    values = {"link.command.delay": delay, "link.computational_delay": computed}
    trim = np.array([0.25, 0.21])
    taken = passed(command_link(values, T), SENT[:, :2], before=trim)
    assert_array_equal(taken[:steps], np.tile(trim, (steps, 1)))
    assert_array_equal(taken[steps:], SENT[:-steps, :2])


def test_time_of_computation_is_whole_periods_and_the_rest():
    for time, whole, rest in [(0.0, 0, 0.0), (0.005, 0, 0.25), (0.06, 3, 0.0), (0.027, 1, 0.35), (0.14, 7, 0.0)]:
        found = computation({"link.computational_delay": time}, T)
        assert found == (whole, pytest.approx(rest, abs=1e-9))
        assert (found[1] == 0.0) == (rest == 0.0)


def test_losses_in_bursts_have_their_share_and_their_mean_length():
    lost = held(np.vstack([measured(seed=seed, loss=0.1, burst=4.0) for seed in range(10)]))
    edges = np.flatnonzero(np.diff(lost.astype(int)))
    runs = np.count_nonzero(np.diff(lost.astype(int)) == 1)
    # For a Markov chain with these two means, the number of losses has about seven times the independent variance.
    assert lost.mean() == pytest.approx(0.1, abs=4.0 * math.sqrt(7.0 * 0.1 * 0.9 / len(lost)))
    assert lost.sum() / runs == pytest.approx(4.0, rel=0.15)
    assert len(edges) > 1000
    assert held(measured(loss=1.0)).sum() == STEPS - 1


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("delay", 0.5, "link.command.delay = 0.5: expected double from 0 to 50, whole"),
        ("burst", 0.5, "link.command.burst = 0.5: expected 0, or at least 9"),
    ],
)
def test_what_is_no_link_is_refused(field, value, message):
    with pytest.raises(ParameterError, match=message):
        command_link({"link.command.loss": 0.9, f"link.command.{field}": value}, T)

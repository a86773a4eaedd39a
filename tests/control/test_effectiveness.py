"""The estimator of the elevator's effectiveness: its intervals contain the truth, and it reacts to faults."""

import core_calls as calls
import numpy as np
import pytest
from flights import components
from marking import long

from hsv.base.errors import ParameterError
from hsv.control.effectiveness import EffectivenessMode, effectiveness_in
from hsv.control.tube_law import tube_memory
from hsv.core import doubles, lib, records, vector
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.corners import corners
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.plant import FlightStatus
from hsv.model.vehicle import load_vehicle

FAULT = 5000
"""Step at which Case 1's fault begins."""


def active(effectiveness=0.9, **fault):
    changes = {f"fault[0].{name}": value for name, value in fault.items()}
    return assemble_flight(load_scenario("case1_active", {"fault[0].effectiveness": effectiveness, **changes}))


def known_along(parts, flight):
    """Return the estimates of ``parts`` after each step of a ``flight``."""
    data = parts.controller.kernel.effectiveness
    return calls.effectiveness_along(data, flight.history.estimate, flight.history.command)


def effectiveness_step(data, memory, step, x):
    """Return the effectiveness by which the elevator command of a step is divided."""
    return lib.hsv_effectiveness_step(data.pointer, records("hsv_tube_memory", memory), step, doubles(vector(x)))


def effectiveness_bounds(data, *step):
    """Return the intervals (4 bounds) of effectiveness and offset that are consistent with one step."""
    bounds = np.empty(4)
    lib.hsv_effectiveness_bounds(data.pointer, step, doubles(bounds))
    return bounds


def test_true_effectiveness_is_in_the_interval_where_the_disturbance_keeps_its_bound():
    data = active().controller.kernel.effectiveness
    random = np.random.default_rng(1)
    for _ in range(2000):
        effect, e = random.uniform(-0.02, -0.001, 2)
        true, g = random.uniform(0.3, 1.0), random.uniform(-data.effect, data.effect)
        i, d, turn = random.uniform(-data.inertia, data.inertia), random.uniform(-1e-3, 1e-3), random.normal(0.0, 5e-3)
        v = random.uniform(-data.bound, data.bound) * abs(e)
        # (1 + i) D + b = P (1 + g) e + d + v and y = D + b; d is known from healthy steps, where g = 0.
        y = true * (1.0 + g) * e + d + v - i * turn
        low, high, _, _ = effectiveness_bounds(data, y, e, turn, d + g * effect, effect)
        assert low <= true <= high


@pytest.mark.parametrize("effectiveness", [0.5, long(0.9)])
def test_loss_is_found_in_two_steps_and_exactly(effectiveness):
    parts = active(effectiveness)
    flight = fly(parts)
    known = known_along(parts, flight)
    assert all(k.mode is EffectivenessMode.HEALTHY and k.estimate == 1.0 for k in known[: FAULT + 1])
    assert known[FAULT + 1].mode is EffectivenessMode.PENDING
    assert all(k.mode is EffectivenessMode.LOSS for k in known[FAULT + 2 :])
    assert all(k.low <= effectiveness <= k.high for k in known[FAULT + 2 :])
    assert known[FAULT + 2].estimate == pytest.approx(effectiveness, abs=2e-3)
    assert known[-1].estimate == pytest.approx(effectiveness, abs=1e-3)


def test_half_an_elevator_is_survived_by_the_active_law_alone():
    passive = assemble_flight(load_scenario("case1", {"fault[0].effectiveness": 0.5}))
    assert fly(passive).status is FlightStatus.DIVERGED
    flight = fly(assemble_flight(load_scenario("case1_active_deep")))
    assert flight.status is FlightStatus.FINISHED
    assert abs(flight.metrics["altitude_end_error"]) < 0.01
    assert flight.metrics["saturated_steps"] == 0


@pytest.mark.long
def test_no_false_alarm_at_any_corner():
    """Without an alarm, a flight with the active law has the same bits as one with the passive law."""
    passive, watched = (
        assemble_flight(load_scenario(name, {"fault[0].effectiveness": 1.0})) for name in ("case1", "case1_active")
    )
    every = corners(load_vehicle().uncertainty)
    assert len(every) == 1025
    flights = [fly_perturbed(parts, every, lambda _, flight: flight.fingerprint) for parts in (passive, watched)]
    assert flights[0] == flights[1]


@pytest.mark.long
def test_half_an_elevator_is_survived_at_every_corner():
    parts = active(0.5)
    ended = fly_perturbed(parts, corners(load_vehicle().uncertainty), lambda _, flight: flight.status)
    assert set(ended) == {FlightStatus.FINISHED}


def test_recovery_of_the_elevator_is_followed():
    parts = active(0.6, stop="120 s")
    flight = fly(parts)
    known = known_along(parts, flight)
    assert flight.status is FlightStatus.FINISHED
    assert known[-1].mode is EffectivenessMode.HEALTHY and known[-1].estimate == 1.0


def test_an_offset_is_not_taken_for_a_loss():
    bias = {"fault.types": ["bias"], "fault.parameters": [f"offset={float(np.deg2rad(-5.0))!r}"]}
    parts = components("case1_active", **bias)
    flight = fly(parts)
    known = known_along(parts, flight)
    assert flight.status is FlightStatus.FINISHED
    assert known[-1].mode is EffectivenessMode.OTHER and known[-1].estimate == 1.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_step_that_is_no_number_changes_nothing(value):
    parts = active()
    data = parts.controller.kernel.effectiveness
    memory = tube_memory()
    x, u = data.start.copy(), np.array([0.27, 0.21])
    for step in range(5):
        effectiveness_step(data, memory, step, x)
        memory["held"] = u
    before = effectiveness_in(memory)
    bad = np.full(9, value)
    assert effectiveness_step(data, memory, 5, bad) == before.estimate
    memory["held"] = u
    assert effectiveness_step(data, memory, 6, x) == before.estimate
    assert np.isfinite(memory["known"]).all()


@pytest.mark.parametrize(("name", "value"), [("least", 0.0), ("bound", 0.0), ("steps", 1.5), ("time", 0.0)])
def test_a_wrong_parameter_is_named(name, value):
    with pytest.raises(ParameterError, match=f"effectiveness.{name}"):
        components("case1_active", **{f"effectiveness.{name}": value})

"""Faults of actuators and effectors compared with their formulas on every substep."""

import math

import numpy as np
import pytest
from core_calls import begin_faults, move_effectors
from numpy.testing import assert_allclose, assert_array_equal

from hsv.model.actuators import SUBSTEPS, actuator_data, actuators_at_rest
from hsv.model.faults.schedule import fault_rows
from hsv.model.faults.table import DYNAMICS, EFFECTOR, Fault
from hsv.model.vehicle import load_vehicle

T, H = 0.02, 0.005
ELEVATOR = "elevator_deflection"
NEVER = 2**62
VEHICLE = load_vehicle().coupled()
TRIM = np.array([0.3, 0.2])
STOP = math.radians(30.0)
ALPHA = 0.03
STEPS = 60
WAVE = 0.2 + 0.1 * np.sin(0.3 * np.arange(STEPS))
MIDDLES = (np.arange(STEPS * SUBSTEPS) + 0.5) * H


def elevator(kind, **parameters):
    return Fault.of(ELEVATOR, kind, parameters)


def flown(faults, commands=WAVE, actuator=None):
    """Return the deflections of the elevator and the states of its actuator on every substep."""
    data = actuator_data(actuator or {}, VEHICLE, T)
    rows = fault_rows([DYNAMICS, EFFECTOR], [row if len(row) == 3 else (*row, NEVER) for row in faults], T)
    effector, state, deflections, states = TRIM.copy(), actuators_at_rest(TRIM), [], []
    for k, command in enumerate(commands):
        begin_faults(rows, k, 0)
        for j in range(SUBSTEPS):
            move_effectors(data, (state, effector), rows, k, j, np.array([0.4, command]), ALPHA)
            deflections.append(effector[1])
            states.append(state[1].copy())
    return np.array(deflections), np.array(states)


def held(commands=WAVE):
    return np.repeat(commands, SUBSTEPS)


SECOND_ORDER = {"actuator.elevator_deflection.set": "elevator_50"}


def test_scale_bias_and_drift_act_on_the_position():
    assert_array_equal(flown([(elevator("effector_scale", factor=0.7), 0)])[0], 0.7 * held())
    assert_array_equal(flown([(elevator("bias", offset=-0.05), 0)])[0], held() - 0.05)
    drift = flown([(elevator("drift", rate=-0.1, limit=0.04), 10)])[0]
    assert_allclose(drift, held() - np.clip(0.1 * (MIDDLES - 10 * T), 0.0, 0.04), rtol=1e-13)


@pytest.mark.parametrize("frequency", [0.5, 2.5, 10.0])
def test_liquid_oscillation_is_added_and_solid_replaces(frequency):
    given = {"amplitude": 0.03, "frequency": frequency, "phase": 0.4}
    wave = 0.03 * np.sin(2.0 * np.pi * frequency * (MIDDLES - 5 * T) + 0.4)
    wave[: 5 * SUBSTEPS] = 0.0
    assert_allclose(flown([(elevator("oscillation", **given), 5)])[0], held() + wave, atol=1e-14)
    solid = flown([(elevator("solid_oscillation", **given), 5)])[0]
    assert_allclose(solid[5 * SUBSTEPS :], WAVE[4] + wave[5 * SUBSTEPS :], atol=1e-14)


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("lock_in_place", {}),
        ("lock_at", {"position": 0.1}),
        ("hard_over", {"rate": 1.5}),
        ("solid_oscillation", {"amplitude": 0.03, "frequency": 2.5}),
    ],
)
def test_what_holds_the_surface_holds_the_actuator_what_cuts_it_off_does_not(kind, given):
    deflection, states = flown([(elevator(kind, **given), 20, 40)], actuator=SECOND_ORDER)
    stuck = slice(20 * SUBSTEPS, 40 * SUBSTEPS)
    assert_array_equal(states[stuck, 0], deflection[stuck])
    assert_array_equal(states[stuck, 1], 0.0)
    _, floating = flown([(elevator("float"), 20, 40)], actuator=SECOND_ORDER)
    assert_array_equal(floating, flown([], actuator=SECOND_ORDER)[1])


@pytest.mark.parametrize("rate", [1.5, -1.5])
def test_hard_over_runs_to_its_stop_at_its_rate(rate):
    deflection, _ = flown([(elevator("hard_over", rate=rate), 10)])
    expected = np.clip(WAVE[9] + rate * (MIDDLES - 10 * T), -STOP, STOP)[10 * SUBSTEPS :]
    assert_allclose(deflection[10 * SUBSTEPS :], expected, rtol=1e-12, atol=1e-15)
    assert abs(deflection[-1]) == pytest.approx(STOP)


def test_of_what_replaces_the_position_the_newest_wins():
    lock, over = (elevator("lock_at", position=0.1), 10), (elevator("hard_over", rate=-1.0), 20)
    for order in ([lock, over], [over, lock]):
        deflection, _ = flown(order)
        assert_array_equal(deflection[10 * SUBSTEPS : 20 * SUBSTEPS], 0.1)
        assert_allclose(deflection[20 * SUBSTEPS], 0.1 - 0.5 * H)

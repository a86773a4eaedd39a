"""Faults of actuators and effectors: each law against its formula on every substep, and how they are composed."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from core_calls import begin_faults, move_effectors
from numpy.testing import assert_allclose, assert_array_equal

from hsv.model.actuators import SUBSTEPS, actuator_data, actuators_at_rest
from hsv.model.dynamics import advance
from hsv.model.faults.schedule import fault_rows
from hsv.model.faults.table import DYNAMICS, EFFECTOR, Fault
from hsv.model.plant import Plant
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

T, H = 0.02, 0.005
FUEL, ELEVATOR = "fuel_equivalence_ratio", "elevator_deflection"
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


def flown(faults, commands=WAVE, actuator=None, seed=0):
    """Return what the elevator does on every substep, and its actuator's states."""
    data = actuator_data(actuator or {}, VEHICLE, T)
    rows = fault_rows([DYNAMICS, EFFECTOR], [row if len(row) == 3 else (*row, NEVER) for row in faults], T)
    effector, state, deflections, states = TRIM.copy(), actuators_at_rest(TRIM), [], []
    for k, command in enumerate(commands):
        begin_faults(rows, k, seed)
        for j in range(SUBSTEPS):
            move_effectors(data, (state, effector), rows, k, j, np.array([0.4, command]), ALPHA)
            deflections.append(effector[1])
            states.append(state[1].copy())
    return np.array(deflections), np.array(states)


def held(commands=WAVE):
    return np.repeat(commands, SUBSTEPS)


SECOND_ORDER = {"actuator.elevator_deflection.set": "elevator_50"}


def test_without_faults_an_ideal_effector_is_where_its_command_is():
    assert_array_equal(flown([])[0], held())


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


def test_lock_freezes_position_and_rate_and_frees_them_where_it_held():
    deflection, states = flown([(elevator("lock_in_place"), 20, 40)], actuator=SECOND_ORDER)
    stuck = slice(20 * SUBSTEPS, 40 * SUBSTEPS)
    assert_array_equal(deflection[stuck], deflection[20 * SUBSTEPS - 1])
    assert_array_equal(states[stuck, 1], 0.0)
    assert abs(deflection[40 * SUBSTEPS] - deflection[40 * SUBSTEPS - 1]) < 0.01
    assert abs(deflection[-1] - WAVE[-1]) < 0.05
    assert_array_equal(flown([(elevator("lock_at", position=0.1), 20)])[0][20 * SUBSTEPS :], 0.1)


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


def test_float_has_no_force_or_lies_in_the_flow():
    assert_array_equal(flown([(elevator("float"), 0)])[0], 0.0)
    assert_allclose(flown([(elevator("float", alignment=1.0), 0)])[0], -ALPHA)


@pytest.mark.parametrize("rate", [1.5, -1.5])
def test_hard_over_runs_to_its_stop_at_its_rate(rate):
    deflection, _ = flown([(elevator("hard_over", rate=rate), 10)])
    expected = np.clip(WAVE[9] + rate * (MIDDLES - 10 * T), -STOP, STOP)[10 * SUBSTEPS :]
    assert_allclose(deflection[10 * SUBSTEPS :], expected, rtol=1e-12, atol=1e-15)
    assert abs(deflection[-1]) == pytest.approx(STOP)


def test_rate_limit_makes_a_ramp_even_of_an_ideal_actuator():
    commands = np.where(np.arange(STEPS) < 10, 0.2, 0.4)
    deflection, _ = flown([(elevator("rate_limit", rate=0.5), 0)], commands)
    assert_allclose(deflection, 0.2 + np.clip(0.5 * (MIDDLES - 10 * T), 0.0, 0.2), atol=1.3e-3)
    assert np.diff(deflection).max() == pytest.approx(0.5 * H)


def test_lower_bandwidth_is_that_of_a_slower_actuator():
    slow, _ = flown([(elevator("bandwidth", natural_frequency=20.0), 0)], actuator=SECOND_ORDER)
    own = {**SECOND_ORDER, "actuator.elevator_deflection.natural_frequency": [20.0]}
    assert_array_equal(slow, flown([], actuator=own)[0])
    lag = {"actuator.elevator_deflection.set": "elevator_first_order_20"}
    ideal, _ = flown([(elevator("bandwidth", natural_frequency=20.0), 0)])
    assert_array_equal(ideal, flown([], actuator=lag)[0])
    assert_array_equal(
        flown([(elevator("bandwidth", natural_frequency=90.0), 0)], actuator=SECOND_ORDER)[0],
        flown([], actuator=SECOND_ORDER)[0],
    )


def test_composition_does_not_depend_on_the_order_of_the_list():
    faults = [
        (elevator("bias", offset=0.02), 12),
        (elevator("effector_scale", factor=0.9), 5),
        (elevator("oscillation", amplitude=0.02, frequency=3.0), 0),
        (elevator("rate_limit", rate=0.8), 8),
        (elevator("bias", offset=-0.013), 2),
    ]
    results = [flown(order)[0] for order in itertools.islice(itertools.permutations(faults), 0, 120, 23)]
    for result in results[1:]:
        assert_array_equal(result, results[0])
    late = slice(20 * SUBSTEPS, None)
    limited = flown([faults[3]])[0][late]
    wave = 0.02 * np.sin(6.0 * np.pi * MIDDLES[late])
    assert_allclose(results[0][late], 0.9 * limited + 0.02 - 0.013 + wave, atol=1e-13)


def test_of_what_replaces_the_position_the_newest_wins():
    lock, over = (elevator("lock_at", position=0.1), 10), (elevator("hard_over", rate=-1.0), 20)
    for order in ([lock, over], [over, lock]):
        deflection, _ = flown(order)
        assert_array_equal(deflection[10 * SUBSTEPS : 20 * SUBSTEPS], 0.1)
        assert_allclose(deflection[20 * SUBSTEPS], 0.1 - 0.5 * H)


def test_stops_of_the_actuator_hold_whatever_fails():
    assert flown([(elevator("bias", offset=0.5), 0)])[0].max() == STOP
    assert flown([(elevator("effector_scale", factor=-1.0), 0), (elevator("bias", offset=-0.5), 0)])[0].min() == -STOP


START = trim(VEHICLE, 26060.4, 2407.92)


def plant(actuator=None, late=0.0):
    """Return the plant whose actuators have the command ``late`` substeps after a period begins."""
    made = Plant(VEHICLE, START, T, 1000, 2, actuator)
    made.data = replace(made.data, late=late)
    return made


def equipped(commands, actuator=None, faults=(), late=0.0):
    """Return the last state and effector of a flight with commands beyond those of the trim."""
    flown = plant(actuator, late)
    for command in START.input + commands:
        result = flown.step(command, faults)
    return result.state, result.effector


COMMANDS = 0.01 * np.sin(np.arange(50)[:, None] * np.array([0.2, 0.3]))


def test_vehicle_with_ideal_actuators_is_the_bare_one_to_the_bit():
    x = START.state
    for command in START.input + COMMANDS:
        x = advance(x, command, VEHICLE, T, 2)
    assert_array_equal(equipped(COMMANDS)[0], x)
    later = elevator("bias", offset=0.1)
    assert_array_equal(equipped(COMMANDS, faults=((later, 50),))[0], x)


@pytest.mark.parametrize("late", [0.4, 1.0, 2.7, 4.0 - 1e-9])
def test_a_late_command_switches_within_the_period(late):
    x, tau, before = START.state, late * H, START.input
    for command in START.input + COMMANDS:
        x = advance(advance(x, before, VEHICLE, tau, 40), command, VEHICLE, T - tau, 40)
        before = command
    # Both are accurate to far more than what a tenth of a substep would change.
    found = equipped(COMMANDS, late=late)[0]
    assert_allclose(found, x, rtol=1e-5)
    assert np.abs(equipped(COMMANDS, late=late - 0.1)[0] - x).max() > 100.0 * np.abs(found - x).max()

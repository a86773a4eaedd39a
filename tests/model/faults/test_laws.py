"""Faults of the command and of the engine: formulas, times of action, composition, and refused values."""

import itertools
import math

import numpy as np
import pytest
from core_calls import command_faults, engine_faults
from numpy.testing import assert_allclose, assert_array_equal

from hsv.base.errors import ParameterError
from hsv.model.faults.schedule import fault_rows
from hsv.model.faults.table import (
    CHANNELS,
    COMMAND,
    DYNAMICS,
    EFFECTOR,
    ENGINE_SIDE,
    FAULT_KINDS,
    SENSOR,
    Fault,
    read_fault,
)
from hsv.model.faults.table import OCCURRENCE_PARAMETERS as OCCURRENCE

T = 0.02
FUEL, ELEVATOR = "fuel_equivalence_ratio", "elevator_deflection"
NEVER = 2**62


def elevator(kind, **parameters):
    return Fault.of(ELEVATOR, kind, parameters)


def flown(faults, commands, seed=0):
    """Return the elevator commands after faults, each given with its first step and perhaps its end."""
    rows = fault_rows([COMMAND], [row if len(row) == 3 else (*row, NEVER) for row in faults], T)
    actuator = np.array([command_faults(rows, k, seed, [0.4, command]) for k, command in enumerate(commands)])
    assert (actuator[:, 0] == 0.4).all()
    return actuator[:, 1]


WAVE = 0.2 + 0.1 * np.sin(0.3 * np.arange(120))


def test_loss_over_a_ramp_begins_with_nothing_and_ends_as_an_abrupt_one():
    result = flown([(elevator("loss_of_effectiveness", effectiveness=0.4, ramp_time=1.0), 10)], WAVE)
    share = np.interp(np.arange(120) * T, [10 * T, 10 * T + 1.0], [1.0, 0.4])
    assert_allclose(result, share * WAVE, rtol=1e-13)
    assert_array_equal(result[60:], 0.4 * WAVE[60:])


def test_reversal_is_of_the_total_or_about_the_trim():
    assert_array_equal(flown([(elevator("reversal"), 0)], WAVE), -WAVE)
    about = flown([(elevator("reversal", about_start=1.0), 0)], WAVE)
    assert_allclose(about - WAVE[0], -(WAVE - WAVE[0]), rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize("steps", [1, 2, 5, 50])
def test_delay_is_exact_and_begins_with_the_command_of_its_start(steps):
    result = flown([(elevator("delay", steps=steps), 7)], WAVE)
    expected = WAVE.copy()
    expected[7:] = WAVE[np.maximum(np.arange(7, 120) - steps, 7)]
    assert_array_equal(result, expected)


def test_composition_does_not_depend_on_the_order_of_the_list():
    faults = [
        (elevator("backlash", width=0.02), 3),
        (elevator("loss_of_effectiveness", effectiveness=0.8), 10),
        (elevator("loss_of_effectiveness", effectiveness=0.7), 0),
        (elevator("delay", steps=3), 5),
        (elevator("dead_zone", width=0.03), 0),
    ]
    results = [flown(order, WAVE) for order in itertools.islice(itertools.permutations(faults), 0, 120, 17)]
    for result in results[1:]:
        assert_array_equal(result, results[0])
    # The same faults applied one after another.
    lost = flown([(faults[2][0], 0), (faults[1][0], 10)], WAVE)
    by_hand = flown([faults[0]], flown([faults[4]], flown([faults[3]], lost)))
    assert_array_equal(results[0], by_hand)
    assert_array_equal(lost[10:], 0.8 * (0.7 * WAVE[10:]))


def test_periodic_fault_acts_for_its_share_of_each_period():
    fault = elevator("loss_of_effectiveness", effectiveness=0.0, intermittent_period=0.2, intermittent_duty=0.3)
    result = flown([(fault, 13)], np.ones(120))
    expected = np.array([k < 13 or (k - 13) % 10 >= 3 for k in range(120)])
    assert_array_equal(result, expected.astype(float))


def test_random_fault_comes_and_goes_as_a_markov_chain():
    fault = elevator("loss_of_effectiveness", effectiveness=0.0, random_on=0.4, random_off=1.2)
    result = flown([(fault, 5)], np.ones(40000))
    assert not result[5] and result[:5].all()
    acts = result == 0.0
    assert acts.mean() == pytest.approx(0.25, abs=0.03)
    lengths = [len([*group]) for value, group in itertools.groupby(acts[5:]) if value]
    assert np.mean(lengths) * T == pytest.approx(0.4, rel=0.1)
    assert_array_equal(result, flown([(fault, 5)], np.ones(40000)))
    assert (result != flown([(fault, 5)], np.ones(40000), seed=1)).any()


def engine(fault, points, start=0):
    """Return the engine's factors at ``points`` (angle of attack, Mach number, fuel), one point per step."""
    rows = fault_rows([ENGINE_SIDE], [(fault, start, NEVER)], T)
    return np.array([engine_faults(rows, k, 0, *point) for k, point in enumerate(points)])


def test_unstarted_inlet_changes_thrust_lift_drag_and_moment():
    fault = Fault.of("engine", "inlet_unstart", {"moment_zero": 0.03, "moment_alpha": 0.5})
    [row] = engine(fault, [(0.04, 8.0, 0.3)])
    assert_allclose(row, [0.0, 0.8, 1.2, 0.03 + 0.5 * 0.04])


def test_inlet_unstarts_outside_an_ellipse_and_restarts_well_inside_and_late_enough():
    reach, wide = math.radians(4.0), {"mach": 8.0, "mach_reach": 0.5, "hysteresis": 0.2}
    given = {"angle_of_attack_reach": reach, **wide}
    fault = Fault.of("engine", "inlet_unstart_outside", given)
    shares = [0.0, 0.9, 1.01, 0.9, 0.81, 0.79, 0.9, 0.99]
    points = [(share * reach * 0.6, 8.0 + 0.8 * share * 0.5, 0.3) for share in shares]
    assert_array_equal(engine(fault, points)[:, 0], [1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    late = Fault.of("engine", "inlet_unstart_outside", {**given, "restart_time": 3 * T})
    points = [(1.1 * reach, 8.0, 0.3)] + [(0.0, 8.0, 0.3)] * 4
    assert_array_equal(engine(late, points)[:, 0], [0.0, 0.0, 0.0, 1.0, 1.0])
    rich = Fault.of("engine", "inlet_unstart_outside", {"fuel_limit": 1.0, "hysteresis": 0.1})
    points = [(0.0, 8.0, fuel) for fuel in (0.9, 1.0, 1.1, 0.95, 0.85)]
    assert_array_equal(engine(rich, points)[:, 0], [1.0, 1.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("name", FAULT_KINDS)
def test_every_kind_is_described_and_may_be_scheduled_on_its_channels(name):
    kind = FAULT_KINDS[name]
    assert kind.meaning and kind.channels and {*kind.channels} <= {*CHANNELS}
    for channel in kind.channels:
        due = [p for p in kind.parameters if p.default is None]
        given = {p.name: 2.0 if p.whole else p.of(channel).maximum / 2.0 for p in due}
        fault = Fault.of(channel, name, given)
        assert f"{name} " in str(fault) and str(fault).endswith(f"of {channel}")
        assert Fault.of(channel, name, fault.parameters) == fault
        sides = (COMMAND, DYNAMICS, EFFECTOR, ENGINE_SIDE, SENSOR)
        assert sum(len(fault_rows([side], [(fault, 0, NEVER)], T).rows) for side in sides) == 1
        for parameter in (*kind.parameters, *OCCURRENCE):
            described = parameter.of(channel)
            assert described.description and described.minimum <= described.default <= described.maximum


def test_a_fault_is_written_with_units_and_its_one_due_parameter_without_name():
    fault = elevator("loss_of_effectiveness", effectiveness=0.8, ramp_time=0.5)
    for first in ("80 %", "effectiveness=0.8"):
        assert read_fault(ELEVATOR, "loss_of_effectiveness", [first, "ramp_time=500 ms"]) == fault
    with pytest.raises(ParameterError, match=r"^fault\.0\.1 Hz: unknown parameter, expected "):
        read_fault(ELEVATOR, "oscillation", ["0.1 Hz"])


CROSSED = {"lower": math.radians(10.0), "upper": math.radians(5.0)}
BOTH = {"random_on": 1.0, "random_off": 1.0, "intermittent_period": 2.0}


@pytest.mark.parametrize(
    ("channel", "kind", "parameters", "message"),
    [
        (ELEVATOR, "jam", {}, "fault.type = 'jam': expected one of loss_of_effectiveness"),
        ("engine", "bias", {"offset": 0.1}, "fault.channel = 'engine': expected one of fuel_equivalence_ratio"),
        (FUEL, "float", {}, "fault.channel = 'fuel_equivalence_ratio': expected one of elevator_deflection for float"),
        (ELEVATOR, "bias", {}, "fault.offset: missing, expected offset for bias"),
        (ELEVATOR, "bias", {"value": 0.1}, "fault.value: unknown parameter, expected one of offset, "),
        (ELEVATOR, "lock_in_place", {"offset": 1.0}, "fault.offset: unknown parameter, expected one of"),
        (ELEVATOR, "bias", {"offset": 0.6}, "fault.offset = 0.6: expected double from -0.5235987756 to 0.523598"),
        (ELEVATOR, "bias", {"offset": True}, "fault.offset = True: expected double from -0.5235987756 to 0.523598"),
        (ELEVATOR, "delay", {"steps": 2.5}, "fault.steps = 2.5: expected double from 1 to 50, whole"),
        (ELEVATOR, "hard_over", {"rate": 0.0}, "fault.rate = 0: expected a rate whose sign selects the stop"),
        (ELEVATOR, "stop_limit", CROSSED, "fault.lower = 10 deg: expected at most upper, 5 deg"),
        (ELEVATOR, "lock_in_place", {"random_on": 1.0}, "fault.random_off = 0 s: expected above 0 s"),
        (ELEVATOR, "lock_in_place", BOTH, "fault.intermittent_period = 2 s: expected 0 s"),
        ("pitch", "sensor_freeze", {}, "fault.channel = 'pitch': expected one of altitude, velocity"),
    ],
)
def test_what_is_no_fault_is_refused(channel, kind, parameters, message):
    with pytest.raises(ParameterError, match="^" + message.replace("(", r"\(")):
        Fault.of(channel, kind, parameters)

import numpy as np
import pytest
from hsv.faults.actuator import FAULT_PARAMETERS, FAULT_TYPES, Fault, FaultInjector, apply_faults, faulty, first_step
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from hsv.errors import ParameterError
from hsv.vehicle.dynamics import INPUT_NAMES

COMMAND = np.array([0.4, 0.2])
ELEVATOR = "elevator_deflection"
FUEL = "fuel_equivalence_ratio"


def loss(value, channel=ELEVATOR):
    return Fault(channel, "loss_of_effectiveness", value)


def actuator(injector, step, command=COMMAND):
    return injector.step(step, command).actuator


def test_without_faults_the_command_passes_bit_for_bit():
    injector = FaultInjector()
    for step in range(5):
        result = injector.step(step, COMMAND)
        assert_array_equal(result.actuator, COMMAND)
        assert result.active == ()


def test_result_does_not_alias_the_command():
    command = COMMAND.copy()
    result = FaultInjector().step(0, command)
    command[:] = 9.0
    assert_array_equal(result.actuator, COMMAND)


def test_loss_of_effectiveness_acts_on_the_total_command_of_its_channel_only():
    injector = FaultInjector([(loss(0.9), 0)])
    assert_array_equal(actuator(injector, 0), [0.4, 0.9 * 0.2])
    injector = FaultInjector([(loss(0.5, FUEL), 0)])
    assert_array_equal(actuator(injector, 0), [0.2, 0.2])


@pytest.mark.parametrize("name", FAULT_TYPES)
def test_every_type_of_the_table_flies_at_its_bounds(name):
    kind = FAULT_TYPES[name]
    assert kind.meaning
    for value in (kind.minimum, kind.maximum):
        for channel in INPUT_NAMES:
            result = FaultInjector([(Fault(channel, name, value), 0)]).step(0, COMMAND)
            assert np.all(np.isfinite(result.actuator))
            assert result.active == (Fault(channel, name, value),)
    assert len({t.code for t in FAULT_TYPES.values()}) == len(FAULT_TYPES)


def test_full_effectiveness_changes_nothing_and_none_leaves_nothing():
    assert faulty(0, 1.0, 0.3) == 0.3
    assert faulty(0, 0.0, 0.3) == 0.0


@pytest.mark.parametrize(
    ("time", "step"), [(0.0, 0), (100.0, 5000), (100.01, 5001), (0.3, 15), (0.06, 3), (1e5, 5_000_000), (1e-6, 1)]
)
def test_a_fault_acts_from_the_first_step_at_or_after_its_time(time, step):
    assert first_step(time, 0.02) == step


@settings(max_examples=200)
@given(st.integers(0, 10**7), st.sampled_from([0.01, 0.02, 0.05, 0.001]))
def test_the_time_of_a_step_is_that_step(k, period):
    assert first_step(k * period, period) == k


def test_schedule_begins_at_its_step_and_stays():
    injector = FaultInjector([(loss(0.9), 3)])
    flown = [actuator(injector, step)[1] for step in range(6)]
    assert flown == [0.2, 0.2, 0.2, 0.9 * 0.2, 0.9 * 0.2, 0.9 * 0.2]


def test_later_rows_win_on_their_channel():
    injector = FaultInjector([(loss(0.9), 0), (loss(0.5), 2), (loss(0.8, FUEL), 2)])
    assert injector.step(1, COMMAND).active == (loss(0.9),)
    result = injector.step(2, COMMAND)
    assert_array_equal(result.actuator, [0.8 * 0.4, 0.5 * 0.2])
    assert set(result.active) == {loss(0.5), loss(0.8, FUEL)}


def test_injection_acts_from_the_next_step_and_says_which():
    injector = FaultInjector()
    for step in range(4):
        injector.step(step, COMMAND)
    assert injector.inject(loss(0.7)) == 4
    result = injector.step(4, COMMAND)
    assert result.actuator[1] == 0.7 * 0.2
    assert result.active == (loss(0.7),)


def test_injection_replaces_what_acts_on_its_channel():
    injector = FaultInjector([(loss(0.9), 0), (loss(0.8, FUEL), 0)])
    injector.step(0, COMMAND)
    injector.inject(loss(0.5))
    assert set(injector.step(1, COMMAND).active) == {loss(0.5), loss(0.8, FUEL)}


def test_clearing_one_channel_leaves_the_other():
    injector = FaultInjector([(loss(0.9), 0), (loss(0.8, FUEL), 0)])
    injector.step(0, COMMAND)
    assert injector.clear(ELEVATOR) == 1
    result = injector.step(1, COMMAND)
    assert_array_equal(result.actuator, [0.8 * 0.4, 0.2])
    assert result.active == (loss(0.8, FUEL),)


def test_clearing_all_heals_everything_but_not_what_is_still_to_come():
    injector = FaultInjector([(loss(0.9), 0), (loss(0.8, FUEL), 0), (loss(0.5), 5)])
    injector.step(0, COMMAND)
    injector.clear()
    assert_array_equal(actuator(injector, 1), COMMAND)
    assert actuator(injector, 5)[1] == 0.5 * 0.2


def test_reset_returns_to_the_schedule():
    injector = FaultInjector([(loss(0.9), 2)])
    injector.step(0, COMMAND)
    injector.inject(loss(0.1, FUEL))
    injector.clear()
    injector.reset()
    assert_array_equal(actuator(injector, 0), COMMAND)
    assert_array_equal(actuator(injector, 2), [0.4, 0.9 * 0.2])


def test_compiled_schedule_does_the_same_as_the_object():
    injector = FaultInjector([(loss(0.9), 2), (loss(0.5), 4), (loss(0.8, FUEL), 1)])
    out = np.empty(2)
    for step in range(6):
        apply_faults(injector.schedule, step, COMMAND, out)
        assert_array_equal(out, actuator(injector, step))


def test_schedule_from_parameters():
    injector = FaultInjector.from_parameters(
        {
            "period": 0.02,
            "fault.channels": [ELEVATOR, FUEL],
            "fault.types": ["loss_of_effectiveness"] * 2,
            "fault.values": [0.9, 0.8],
            "fault.starts": [100.0, 0.01],
        }
    )
    assert [row[:2] for row in injector.scheduled] == [(loss(0.9), 5000), (loss(0.8, FUEL), 1)]


def test_defaults_are_no_fault():
    assert FaultInjector.from_parameters({p.name: p.default for p in FAULT_PARAMETERS}).scheduled == ()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("rudder", "loss_of_effectiveness", 0.9), "fault.channel = 'rudder': expected one of fuel_equivalence_ratio"),
        ((ELEVATOR, "melted", 0.9), "fault.type = 'melted': expected one of loss_of_effectiveness"),
        ((ELEVATOR, "loss_of_effectiveness", 1.1), "fault.value = 1.1: expected 0 to 1 for loss_of_effectiveness"),
        ((ELEVATOR, "loss_of_effectiveness", float("nan")), "fault.value = nan: expected 0 to 1"),
    ],
)
def test_an_impossible_fault_is_refused_by_name(arguments, message):
    with pytest.raises(ParameterError) as caught:
        Fault(*arguments)
    assert str(caught.value).startswith(message)


def test_an_unknown_channel_cannot_be_cleared():
    with pytest.raises(ParameterError, match=r"channel = 'rudder': expected one of .*, or empty for all"):
        FaultInjector().clear("rudder")


def test_columns_of_different_length_are_refused_by_name():
    values = {"fault.channels": [ELEVATOR, FUEL], "fault.types": ["loss_of_effectiveness"] * 2, "fault.values": [0.9]}
    with pytest.raises(ParameterError, match=r"fault.values: 1 values, expected as many as fault.channels, 2"):
        FaultInjector.from_parameters({**values, "fault.starts": [1.0, 2.0]})


def test_parameters_repeat_what_was_injected_and_cleared_in_flight():
    period = 0.02
    flown = FaultInjector([(loss(0.9), 5), (loss(0.7, FUEL), 2, 4)])
    active = []
    for step in range(30):
        if step == 8:
            flown.inject(loss(0.5))
        if step == 12:
            flown.inject(loss(0.8, FUEL))
        if step == 20:
            flown.clear(ELEVATOR)
        result = flown.step(step, COMMAND)
        active.append((result.active, result.actuator.tolist()))
    again = FaultInjector.from_parameters({"period": period, **flown.parameters(period)})
    repeated = [again.step(step, COMMAND) for step in range(30)]
    assert [(r.active, r.actuator.tolist()) for r in repeated] == active
    assert FaultInjector.from_parameters(FaultInjector().parameters(period)).step(0, COMMAND).active == ()

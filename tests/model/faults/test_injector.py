import numpy as np
import pytest
from numpy.testing import assert_array_equal

from hsv.base.errors import ParameterError
from hsv.model.faults.injector import FaultInjector
from hsv.model.faults.schedule import ActiveFault, ScheduledFault
from hsv.model.faults.table import COMMAND as COMMAND_SIDE
from hsv.model.faults.table import FAULT_KINDS, Fault
from hsv.model.signals import first_step

COMMAND = np.array([0.4, 0.2])
ELEVATOR = "elevator_deflection"
FUEL = "fuel_equivalence_ratio"


def loss(value, channel=ELEVATOR):
    return Fault.of(channel, "loss_of_effectiveness", {"effectiveness": value})


def injector_of(*rows):
    return FaultInjector([ScheduledFault(*row) for row in rows])


def active(*rows):
    return tuple(ActiveFault(*row) for row in rows)


def actuator(injector, step, command=COMMAND):
    return injector.step(step, command).actuator


@pytest.mark.parametrize("kind", FAULT_KINDS)
def test_every_kind_is_told_from_its_start_with_its_parameters(kind):
    channel = FAULT_KINDS[kind].channels[0]
    given = {p.name: p.of(channel).maximum for p in FAULT_KINDS[kind].parameters if p.default is None}
    fault = Fault.of(channel, kind, given)
    injector = injector_of((fault, 2, 4))
    flown = [injector.step(step, COMMAND) for step in range(5)]
    # A sensor fault is announced one step before the measurement on which it acts.
    first = 1 if FAULT_KINDS[kind].side == "sensor" else 2
    assert [bool(result.active) for result in flown] == [first <= step < first + 2 for step in range(5)]
    assert flown[2].active == active((fault, 2))
    assert np.all(np.isfinite([result.actuator for result in flown]))
    if FAULT_KINDS[kind].side != COMMAND_SIDE:
        assert_array_equal(flown[2].actuator, COMMAND)


@pytest.mark.parametrize(
    ("time", "step"), [(0.0, 0), (100.0, 5000), (100.01, 5001), (0.3, 15), (0.06, 3), (1e5, 5_000_000), (1e-6, 1)]
)
def test_a_fault_acts_from_the_first_step_at_or_after_its_time(time, step):
    assert first_step(time, 0.02) == step


def test_a_sensor_that_is_faulty_from_the_start_gives_its_first_measurement_without():
    injector = injector_of((Fault.of("pitch_rate", "sensor_bias", {"offset": 0.1}), 0))
    assert [result.active[0].since for result in (injector.step(step, COMMAND) for step in range(2))] == [1, 1]


def test_faults_of_a_channel_act_together():
    injector = injector_of((loss(0.9), 0), (loss(0.5), 2), (loss(0.8, FUEL), 2))
    assert injector.step(1, COMMAND).active == active((loss(0.9), 0))
    result = injector.step(2, COMMAND)
    assert_array_equal(result.actuator, [0.8 * 0.4, 0.5 * (0.9 * 0.2)])
    assert set(result.active) == set(active((loss(0.9), 0), (loss(0.5), 2), (loss(0.8, FUEL), 2)))


def test_injection_acts_from_the_next_step_and_says_which():
    injector = FaultInjector()
    for step in range(4):
        injector.step(step, COMMAND)
    assert injector.inject(loss(0.7)) == 4
    result = injector.step(4, COMMAND)
    assert result.actuator[1] == 0.7 * 0.2
    assert result.active == active((loss(0.7), 4))
    assert injector.inject(Fault.of("pitch_rate", "sensor_freeze", {})) == 6


def test_injection_replaces_its_own_kind_on_its_channel():
    reversed_ = Fault.of(ELEVATOR, "reversal", {})
    injector = injector_of((loss(0.9), 0), (reversed_, 0), (loss(0.8, FUEL), 0))
    injector.step(0, COMMAND)
    injector.inject(loss(0.5))
    acting = {row.fault for row in injector.step(1, COMMAND).active}
    assert acting == {loss(0.5), reversed_, loss(0.8, FUEL)}


def test_one_kind_can_be_cleared():
    reversed_ = Fault.of(ELEVATOR, "reversal", {})
    injector = injector_of((loss(0.9), 0), (reversed_, 0))
    injector.step(0, COMMAND)
    assert injector.clear(ELEVATOR, "reversal") == 1
    assert injector.step(1, COMMAND).active == active((loss(0.9), 0))
    with pytest.raises(ParameterError, match=r"type = 'melted': expected one of .*, or empty for all"):
        injector.clear(ELEVATOR, "melted")


def test_clearing_all_heals_everything_but_not_what_is_still_to_come():
    injector = injector_of((loss(0.9), 0), (loss(0.8, FUEL), 0), (loss(0.5), 5))
    injector.step(0, COMMAND)
    injector.clear()
    assert_array_equal(actuator(injector, 1), COMMAND)
    assert actuator(injector, 5)[1] == 0.5 * 0.2


def test_schedule_from_parameters():
    injector = FaultInjector.from_parameters(
        {
            "period": 0.02,
            "fault.channels": [ELEVATOR, FUEL],
            "fault.types": ["loss_of_effectiveness"] * 2,
            "fault.parameters": ["effectiveness=0.9", "effectiveness=0.8,ramp_time=1"],
            "fault.starts": [100.0, 0.01],
        }
    )
    slow = Fault.of(FUEL, "loss_of_effectiveness", {"effectiveness": 0.8, "ramp_time": 1.0})
    assert [row[:2] for row in injector.scheduled] == [(loss(0.9), 5000), (slow, 1)]


@pytest.mark.parametrize("text", ["0.9", "effectiveness", "effectiveness=much", "=0.9x"])
def test_parameters_that_are_written_otherwise_are_refused(text):
    values = {"fault.channels": [ELEVATOR], "fault.types": ["loss_of_effectiveness"], "fault.starts": [1.0]}
    with pytest.raises(ParameterError, match=r"fault.parameters: .* expected a form as 'effectiveness=0.9'"):
        FaultInjector.from_parameters({**values, "fault.parameters": [text]})


def test_parameters_repeat_what_was_injected_and_cleared_in_flight():
    flown = injector_of((loss(0.9), 5), (loss(0.7, FUEL), 2, 4), (Fault.of("altitude", "sensor_freeze", {}), 0))
    told = []
    for step in range(30):
        if step == 8:
            flown.inject(loss(0.5))
        if step == 12:
            flown.inject(loss(0.8, FUEL))
        if step == 20:
            flown.clear(ELEVATOR)
        result = flown.step(step, COMMAND)
        told.append((result.active, result.actuator.tolist()))
    again = FaultInjector.from_parameters(flown.parameters())
    repeated = [again.step(step, COMMAND) for step in range(30)]
    assert [(r.active, r.actuator.tolist()) for r in repeated] == told
    assert FaultInjector.from_parameters(FaultInjector().parameters()).step(0, COMMAND).active == ()


def test_a_fault_cannot_come_and_go_within_a_control_period():
    fault = Fault.of("elevator_deflection", "bias", {"offset": 0.01, "intermittent_period": 0.005})
    words = r"fault\.intermittent_period = 0\.005 s: expected 0 s or at least 0\.02 s"
    with pytest.raises(ParameterError, match=words):
        FaultInjector([ScheduledFault(fault, 1)])
    injector = FaultInjector()
    with pytest.raises(ParameterError, match=words):
        injector.inject(fault)
    assert not injector.known

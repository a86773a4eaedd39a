"""Commands that the live page may send, and the answers to refused ones."""

import pytest

from hsv.base.errors import HsvError
from hsv.model.faults.table import Fault
from hsv.pages.live.commands import Change, Clear, Inject, read_command

ELEVATOR = "elevator_deflection"
LOSS = {"command": "inject", "channel": ELEVATOR, "type": "loss_of_effectiveness"}


def test_a_fault_is_asked_for_with_units():
    command = read_command({**LOSS, "parameters": "80 %, ramp_time = 500 ms", "duration": "5 s"})
    fault = Fault.of(ELEVATOR, "loss_of_effectiveness", {"effectiveness": 0.8, "ramp_time": 0.5})
    assert command == Inject(fault, 5.0)


def test_all_faults_are_cleared_or_some():
    assert read_command({"command": "clear"}) == Clear("", "")
    assert read_command({"command": "clear", "channel": ELEVATOR}) == Clear(ELEVATOR, "")


@pytest.mark.parametrize(
    ("fields", "node", "name", "value"),
    [
        ({"command": "pause", "paused": "true"}, "plant", "paused", True),
        ({"command": "pace", "real_time_factor": "2.5"}, "plant", "real_time_factor", 2.5),
        ({"command": "tau", "tau": "0.8, 0.8, 90 %, 0.9, 1"}, "tube_mpc", "feedback.tau", [0.8, 0.8, 0.9, 0.9, 1.0]),
    ],
)
def test_parameters_are_changed(fields, node, name, value):
    command = read_command(fields)
    assert isinstance(command, Change)
    assert (command.node.name, command.parameter.name, command.value) == (node, name, value)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({}, "command: expected, missing"),
        ({"command": 3}, "command = 3: expected a text"),
        ({"command": "land"}, "command = 'land': expected one of pause, pace, tau, inject, clear"),
        ({**LOSS, "channel": "rudder"}, "channel = 'rudder': expected one of fuel_equivalence_ratio"),
        ({**LOSS, "parameters": "much"}, "fault.effectiveness = 'much'"),
        ({**LOSS, "parameters": "share = 1"}, "fault.share: unknown parameter, expected one of effectiveness"),
        ({**LOSS, "parameters": "0.5", "duration": "-1 s"}, "duration = '-1 s': expected from 0 to 100000 s"),
        ({**LOSS, "parameters": "0.5", "duration": "1e300 s"}, "duration = '1e300 s': expected from 0 to 100000 s"),
        ({"command": "pause", "paused": "perhaps"}, "parameter paused = 'perhaps': expected bool"),
        ({"command": "pace", "real_time_factor": "-1"}, "parameter real_time_factor = -1.0: expected double from 0"),
        (
            {"command": "clear", "chanel": ELEVATOR},
            "chanel: unknown field, expected one of channel, type (did you mean",
        ),
        ({"command": "pause", "paused": "true", "tau": "1"}, "tau: unknown field, expected one of paused"),
        ({"command": "tau", "tau": "2"}, "parameter feedback.tau[0] = 2.0: expected"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(fields, words):
    with pytest.raises(HsvError) as refused:
        read_command(fields)
    assert words in str(refused.value) and "\n" not in str(refused.value)

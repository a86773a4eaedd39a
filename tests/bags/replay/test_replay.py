"""A bag is replayed bit for bit; every change in it is found and named."""

import re

import numpy as np
import pytest
from changed_bags import changed_bag
from marking import long
from recorded_flight import record_flight

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import flown_parameters, refuse_vacuous
from hsv.bags.replay.engine import processes_of, replay, rerun
from hsv.base.errors import RecordingError
from hsv.model.faults.table import Fault

CONTROLLER = "tube_mpc"


def quiet(*_):
    """Ignore the progress."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record_flight(tmp_path_factory.mktemp("bags") / "flown", duration=12.0, fault=6.0)


def replay_all(bag):
    values = flown_parameters(bag)
    return {name: replay(bag, process, values, quiet) for name, process in processes_of(CONTROLLER).items()}


def test_faults_injected_and_cleared_in_flight_are_repeated_at_their_steps(tmp_path):
    elevator = "elevator_deflection"
    in_flight = {
        200: lambda injector: injector.inject(
            Fault.of("fuel_equivalence_ratio", "loss_of_effectiveness", {"effectiveness": 0.95})
        ),
        350: lambda injector: injector.inject(Fault.of(elevator, "loss_of_effectiveness", {"effectiveness": 0.8})),
        420: lambda injector: injector.clear("fuel_equivalence_ratio"),
        500: lambda injector: injector.clear(),
    }
    bag = record_flight(tmp_path / "flown", duration=12.0, fault=6.0, in_flight=in_flight)
    values = flown_parameters(bag)
    assert sorted(values.of("fault_injector")["fault.stops"]) != []
    assert all(result.identical for result in replay_all(bag).values())
    assert all(result.identical for result in rerun(bag, CONTROLLER, values, quiet))


@pytest.mark.parametrize(
    ("topic", "node", "fields", "words"),
    [
        long("/hsv/nominal", "tube_mpc", {"gain": [0.0] * 9}, "gain: 9 numbers, expected 18, or none"),
        ("/hsv/actuator", "plant", {"since": [1]}, "since: 1 steps, expected 0, one for each fault in active"),
    ],
)
def test_a_message_that_no_block_can_take_is_named(bag, tmp_path, topic, node, fields, words):
    def spoil(name, messages):
        if name == topic:
            time, data = messages[100]
            message = bag.types.deserialize_cdr(data, bag.topics[topic].type)
            for field, numbers in fields.items():
                setattr(message, field, np.array(numbers, getattr(message, field).dtype))
            messages[100] = time, bytes(bag.types.serialize_cdr(message, bag.topics[topic].type))
        return messages

    spoiled = Bag(changed_bag(bag.folder, tmp_path / "spoiled", messages=spoil))
    refused = f"^{re.escape(f'{spoiled.path}: topic {topic[1:]}: {words}')}$"
    with pytest.raises(RecordingError, match=refused):
        replay(spoiled, processes_of(CONTROLLER)[node], flown_parameters(bag), quiet)


def test_a_lost_message_is_a_difference_of_count(bag, tmp_path):
    def lose(topic, messages):
        return messages[:600] if topic == "/hsv/command" else messages

    lost = Bag(changed_bag(bag.folder, tmp_path / "lost", messages=lose))
    first = replay_all(lost)["tube_mpc"].topics[0].first
    assert first is not None and first.field == "number of messages" and first.step == 600
    assert (first.expected, first.actual) == (600, 601)


def test_a_short_run_proves_nothing(tmp_path):
    bag = record_flight(tmp_path / "short", duration=9.0, fault=3.0)
    with pytest.raises(RecordingError, match=r"active for 9\.\d* s, expected at least 10 s"):
        refuse_vacuous(bag)


def test_a_bag_without_its_parameters_cannot_be_replayed(bag):
    bare = Bag(bag.path)
    del bare.attachments["design.yaml"]
    with pytest.raises(RecordingError, match=r"no attachment design\.yaml: ros2 bag record and convert keep none"):
        flown_parameters(bare)

"""A bag is repeated bit for bit; whatever is changed is found and named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flown_bags import flown_bag, parameters, types, write_bag
from marking import long

from hsv.bags.columns import Track
from hsv.bags.description import CONTROLLERS, RECORDER, TOPICS, graph
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import flown_parameters, refuse_vacuous
from hsv.bags.replay.engine import ProcessComparison, fly, replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.base.errors import RecordingError
from hsv.model.faults.table import Fault

CONTROLLER = "tube_mpc"


def quiet(*_: object) -> None:
    """No progress."""


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Bag:
    return Bag(flown_bag(tmp_path_factory.mktemp("bags") / "flown"))


def replay_all(bag: Bag, design: Path | None = None) -> dict[str, ProcessComparison]:
    values = flown_parameters(bag, design)
    return {name: replay(bag, process, values, quiet) for name, process in processes_of(CONTROLLER).items()}


def tampered(bag: Bag, path: Path, change: Callable[[dict[str, Track]], None]) -> Bag:
    """Return a copy of ``bag`` whose tracks were changed."""
    tracks = {topic: bag.track(topic) for topic in TOPICS}
    change(tracks)
    return Bag(write_bag(path / "tampered", tracks, *parameters(12.0, 6.0)))


def test_table_describes_every_node_of_every_graph() -> None:
    for controller in CONTROLLERS:
        found = processes_of(controller)
        assert set(found) == {node.name for node in graph(controller) if node is not RECORDER}
        outputs = [topic for process in found.values() for topic in process.outputs]
        assert sorted(outputs) == sorted(TOPICS)
        # In the order in which a step passes through: every input is there when it is needed.
        made: set[str] = set()
        for process in found.values():
            assert process.restarts or made.issuperset(process.inputs)
            made.update(process.outputs)
            assert 0.0 <= process.tolerance <= 1e-10 and len(process.reason) > 20


def test_every_process_repeats_in_every_byte(bag: Bag) -> None:
    refuse_vacuous(bag)
    for name, result in replay_all(bag).items():
        assert result.identical and result.passed, name
        assert [topic.actual_count for topic in result.topics] == [601] * len(result.topics)
    assert all(result.identical for result in rerun(bag, CONTROLLER, flown_parameters(bag), quiet))


def test_a_gain_changed_by_a_millionth_is_found(bag: Bag, tmp_path: Path) -> None:
    design, _ = parameters(12.0, 6.0)
    gain = list(design["feedback.gain"])
    gain[9 + 3] *= 1.0 + 1e-6
    file = tmp_path / "under_test.yaml"
    file.write_text(ParameterSections(design | {"feedback.gain": gain}).to_yaml())
    results = replay_all(bag, file)
    assert [name for name, result in results.items() if not result.passed] == ["tube_mpc"]
    first = results["tube_mpc"].topics[0].first
    assert first is not None
    assert first.topic == "/hsv/command" and first.field == "elevator_deflection"
    assert 0 < first.step < 100 and 1e-10 < abs(first.expected - first.actual) < 1e-6
    assert f"step {first.step} /hsv/command elevator_deflection" in str(first)


def test_faults_injected_and_cleared_in_flight_are_repeated_at_their_steps(tmp_path: Path) -> None:
    elevator = "elevator_deflection"
    in_flight = {
        200: lambda injector: injector.inject(
            Fault.of("fuel_equivalence_ratio", "loss_of_effectiveness", {"effectiveness": 0.95})
        ),
        350: lambda injector: injector.inject(Fault.of(elevator, "loss_of_effectiveness", {"effectiveness": 0.8})),
        420: lambda injector: injector.clear("fuel_equivalence_ratio"),
        500: lambda injector: injector.clear(),
    }
    bag = Bag(flown_bag(tmp_path / "flown", in_flight=in_flight))
    values = flown_parameters(bag)
    assert sorted(values.of("fault_injector")["fault.stops"]) != []
    assert all(result.identical for result in replay_all(bag).values())
    assert all(result.identical for result in rerun(bag, CONTROLLER, values, quiet))


@pytest.mark.parametrize(
    ("topic", "node", "fields", "words"),
    [
        long("hsv/filtered_state", "tube_mpc", {"estimate": [0.0]}, "estimate: 1 numbers, expected 9, or none"),
        long(
            "hsv/filtered_state",
            "tube_mpc",
            {"filter_state": [0.0] * 4},
            "filter_state: 4 numbers, expected 2 of the notch filter flown, or none",
        ),
        long("hsv/nominal", "tube_mpc", {"gain": [0.0] * 9}, "gain: 9 numbers, expected 18, or none"),
        ("hsv/actuator", "plant", {"since": [1]}, "since: 1 steps, expected 0, one for each fault in active"),
    ],
)
def test_a_message_that_no_block_can_take_is_named(
    bag: Bag, tmp_path: Path, topic: str, node: str, fields: dict[str, list[float]], words: str
) -> None:
    def spoil(tracks: dict[str, Track]) -> None:
        track, data = tracks[topic], list(tracks[topic].data)
        message = track.types.deserialize_cdr(data[100], track.type)
        for name, numbers in fields.items():
            setattr(message, name, np.array(numbers, getattr(message, name).dtype))
        data[100] = bytes(track.types.serialize_cdr(message, track.type))
        tracks[topic] = replace(track, data=data)

    spoiled = tampered(bag, tmp_path, spoil)
    refused = f"^{re.escape(f'{spoiled.path}: topic {topic}: {words}')}$"
    with pytest.raises(RecordingError, match=refused):
        replay(spoiled, processes_of(CONTROLLER)[node], flown_parameters(bag), quiet)
    if topic == "hsv/actuator":
        with pytest.raises(RecordingError, match=refused):
            flown_parameters(spoiled)


def test_a_lost_message_is_a_difference_of_count(bag: Bag, tmp_path: Path) -> None:
    def lose(tracks: dict[str, Track]) -> None:
        tracks["hsv/command"] = tracks["hsv/command"].cut(600)

    first = replay_all(tampered(bag, tmp_path, lose))["tube_mpc"].topics[0].first
    assert first is not None and first.field == "number of messages" and first.step == 600
    assert (first.expected, first.actual) == (600, 601)


def test_swapped_messages_are_a_difference_of_order(bag: Bag, tmp_path: Path) -> None:
    def swap(tracks: dict[str, Track]) -> None:
        track = tracks["hsv/filtered_state"]
        data = list(track.data)
        data[300], data[301] = data[301], data[300]
        tracks["hsv/filtered_state"] = replace(track, data=data)

    first = replay_all(tampered(bag, tmp_path, swap))["notch_filter"].topics[0].first
    assert first is not None and first.field == "time (ns)"
    assert first.expected - first.actual == 20_000_000


@pytest.mark.long
def test_of_a_broken_off_run_the_complete_steps_are_compared(bag: Bag, tmp_path: Path) -> None:
    def kill(tracks: dict[str, Track]) -> None:
        for index, topic in enumerate(TOPICS):
            tracks[topic] = tracks[topic].cut(560 if index < 4 else 559)

    cut = tampered(bag, tmp_path, kill)
    results = replay_all(cut)
    assert all(result.identical for result in results.values())
    assert {topic.actual_count for result in results.values() for topic in result.topics} == {559}
    assert all(result.identical for result in rerun(cut, CONTROLLER, flown_parameters(cut), quiet))


def test_a_short_run_proves_nothing(tmp_path: Path) -> None:
    bag = Bag(flown_bag(tmp_path / "short", duration=9.0, fault=3.0))
    with pytest.raises(RecordingError, match=r"active for 9\.\d* s, expected at least 10 s"):
        refuse_vacuous(bag)


def test_bags_that_cannot_be_replayed_say_why(bag: Bag, tmp_path: Path) -> None:
    def forget(tracks: dict[str, Track]) -> None:
        del tracks["hsv/nominal"]

    with pytest.raises(RecordingError, match="no topic /hsv/nominal"):
        replay_all(tampered(bag, tmp_path, forget))
    bare = Bag(bag.path)
    del bare.attachments["design.yaml"]
    with pytest.raises(RecordingError, match=r"no attachment design\.yaml: ros2 bag record and convert keep none"):
        flown_parameters(bare)


@pytest.mark.long
def test_tau_changed_in_flight_is_repeated_from_what_was_recorded(tmp_path: Path) -> None:
    design, scenario = parameters(12.0, 6.0)
    design |= {"feedback.tau_minimum": [0.5]}
    changes = {"tau_change.starts": [3.0, 7.02], "tau_change.values": [0.7, 1.0]}
    tracks = fly(types(), CONTROLLER, ParameterSections(design | scenario | {"feedback.tau": [0.9]} | changes), quiet)
    bag = Bag(write_bag(tmp_path / "changed", tracks, design, scenario))
    values = flown_parameters(bag)
    assert values.of("tube_mpc")["feedback.tau"] == [0.9] * 5
    assert values.of("tube_mpc")["tau_change.starts"] == pytest.approx([3.0, 7.02])
    results = [replay(bag, process, values, quiet) for process in processes_of(CONTROLLER).values()]
    assert all(result.identical for result in [*results, *rerun(bag, CONTROLLER, values, quiet)])
    # What was scheduled is no change in flight.
    again = Bag(write_bag(tmp_path / "scheduled", tracks, design, scenario | {"feedback.tau": [0.9]} | changes))
    assert flown_parameters(again).of("tube_mpc")["feedback.tau"] == [0.9]

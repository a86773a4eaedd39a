"""The loop as a table of blocks in the order of a step."""

from hsv.bags.description import CARRIED, CLOCK, TOPICS, graph
from hsv.control.controller import CONTROLLER_INPUTS, ControllerInput
from hsv.flight.blocks import LOOP, Signals
from hsv.model.signals import SignalType


def test_every_signal_of_the_loop_has_one_source_and_follows_it_within_a_step():
    outputs = [signal for each in LOOP for signal in each.outputs]
    assert len(outputs) == len({signal.name for signal in outputs})
    given: set[SignalType] = set()
    for each in LOOP:
        assert given.issuperset(each.inputs), each.name
        assert {*outputs}.issuperset((*each.delayed, *each.state)), each.name
        given.update(each.outputs)


def test_every_signal_travels_on_a_topic_and_has_a_place_in_the_loop():
    given = {signal for each in LOOP for signal in each.outputs}
    assert {signal for carried in CARRIED.values() for signal in carried} == given
    assert CARRIED.keys() == TOPICS.keys() - {CLOCK}
    assert {signal.name for signal in given} <= Signals.__annotations__.keys() | vars(Signals).keys()


def test_every_node_subscribes_to_no_more_than_what_its_block_needs_and_publishes_what_it_gives():
    assert {node.name: (node.subscribes, node.publishes) for node in graph() if node.block} == {
        "plant": (("hsv/actuator",), ("hsv/measurement", "hsv/state", "hsv/forces", "clock")),
        "notch_filter": (("hsv/measurement",), ("hsv/filtered_state",)),
        "nominal_trajectory": (("hsv/measurement",), ("hsv/nominal",)),
        "tube_mpc": (("hsv/filtered_state", "hsv/nominal"), ("hsv/command", "hsv/tube_status")),
        "fault_injector": (("hsv/command",), ("hsv/actuator",)),
    }


def test_a_controller_takes_its_inputs_in_one_order():
    assert ControllerInput._fields == ("step", *(signal.name for signal in CONTROLLER_INPUTS))
    assert LOOP[3].inputs == CONTROLLER_INPUTS

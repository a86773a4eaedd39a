"""The loop as a table: its order is found, and what cannot be ordered is refused."""

import pytest

from hsv.bags.description import CARRIED, CLOCK, TOPICS, graph
from hsv.base.errors import HsvError
from hsv.control.controller import CONTROLLER_INPUTS, ControllerInput
from hsv.flight.blocks import LOOP, Block, Signals, in_order
from hsv.model.signals import SignalType


def block(name, inputs, outputs, delayed=(), unit="m"):
    inputs, outputs, delayed = (tuple(SignalType(n, unit, 1) for n in names) for names in (inputs, outputs, delayed))
    return Block(name, "", inputs, outputs, lambda component, signals: None, delayed)


def test_every_block_finds_what_it_needs_in_whatever_order_they_are_given():
    assert in_order(LOOP) == LOOP
    for shifted in (LOOP[1:] + LOOP[:1], LOOP[::-1]):
        given: set[SignalType] = set()
        for each in in_order(shifted):
            assert given.issuperset(each.inputs), each.name
            given.update(each.outputs)


@pytest.mark.parametrize(
    ("blocks", "words"),
    [
        ([block("a", "y", "x"), block("b", "x", "y")], "algebraic loop a -> b -> a"),
        ([block("a", "x", "x")], "algebraic loop a -> a"),
        ([block("a", "z", "x")], "a: needs z, expected one of x"),
        ([block("a", "", "x", delayed="z")], "a: needs z"),
        ([block("a", "", "x"), block("b", "", "x")], "b: gives x, expected no other block to, a does"),
        ([block("a", "", "x"), block("b", "x", "y", unit="ft")], "b: needs x, 1 in 'ft', expected 1 in 'm' as a gives"),
    ],
)
def test_what_cannot_be_ordered_is_refused(blocks, words):
    with pytest.raises(HsvError, match=words):
        in_order(blocks)


def test_a_loop_over_a_step_is_no_algebraic_one():
    a, b = block("a", "", "x", delayed="y"), block("b", "x", "y")
    assert in_order([b, a]) == (a, b)


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

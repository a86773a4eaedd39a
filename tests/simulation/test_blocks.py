"""The loop as a table: its order is found, and what cannot be ordered is refused."""

import pytest
from flights import components

from hsv.errors import HsvError
from hsv.graph.description import TOPICS, graph
from hsv.simulation.blocks import LOOP, Block, in_order, steps


def block(name, inputs, outputs, delayed=()):
    return Block(name, "", tuple(inputs), tuple(outputs), lambda component, signals: None, tuple(delayed))


def test_every_block_finds_what_it_needs_in_whatever_order_they_are_given():
    assert in_order(LOOP) == LOOP
    for shifted in (LOOP[1:] + LOOP[:1], LOOP[::-1]):
        given: set[str] = set()
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
    ],
)
def test_what_cannot_be_ordered_is_refused(blocks, words):
    with pytest.raises(HsvError, match=words):
        in_order(blocks)


def test_a_loop_over_a_step_is_no_algebraic_one():
    a, b = block("a", "", "x", delayed="y"), block("b", "x", "y")
    assert in_order([b, a]) == (a, b)


def test_every_node_publishes_what_its_block_gives():
    for node in graph():
        if node.block:
            assert node.publishes[: len(node.block.outputs)] == tuple(f"hsv/{s}" for s in node.block.outputs)
    assert {f"hsv/{signal}" for each in LOOP for signal in each.outputs} < TOPICS.keys()


def test_ideal_sensors_say_the_truth():
    flown = [(signals.step, *(signals.measurement - signals.state)) for signals in steps(components(duration=1.0))]
    assert flown == [(k, *[0.0] * 9) for k in range(51)]

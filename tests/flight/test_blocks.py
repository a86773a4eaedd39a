"""The loop as a table of blocks in the order of a step."""

from hsv.bags.description import CARRIED, CLOCK, TOPICS
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

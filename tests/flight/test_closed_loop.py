import pytest
from flights import components, step_by_step
from marking import long
from numpy.testing import assert_array_equal

from hsv.bags.description import CLOCK, TOPIC_FIELDS, TOPICS, graph
from hsv.flight.blocks import LOOP
from hsv.flight.closed_loop import fly
from hsv.model.signals import SignalType

SHORT = {"duration": 6.0, "fault__starts": [3.0]}
HISTORIES = ("state", "filtered_pitch_rate", "deviation", "nominal_input", "u_unsaturated", "command", "actuator")
FACTOR = {"feedback__tau_minimum": [0.5], "feedback__tau": [0.8]}
TWO_NOTCHES = {
    "notch__zero_frequency": [15.0, 19.5],
    "notch__zero_damping": [0.02, 0.05],
    "notch__pole_frequency": [15.0, 19.5],
    "notch__pole_damping": [0.5, 0.2],
    # The invariant set of the shipped design holds only for a filter of one section.
    "tube__centre": [],
    "tube__shape": [],
    "tube__half_width": [],
}


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("case1", SHORT),
        ("case1_rmpc", SHORT),
        ("case1_integral_heavy", SHORT),
        ("case2_baseline", {"duration": 40.0, "nominal__filtered": True} | FACTOR),
        ("case1_qp", {"duration": 1.0, "fault__starts": [0.5]}),
        long("case1_qp", {"duration": 104.0}),
        ("case1", SHORT | TWO_NOTCHES),
        ("case1", {"duration": 0.0}),
        ("case1_derived_no_notch", {}),
    ],
)
def test_compiled_loop_equals_the_components_step_by_step_bit_for_bit(scenario, changes):
    compiled = fly(components(scenario, **changes))
    stepped = step_by_step(components(scenario, **changes))
    for name in HISTORIES:
        assert_array_equal(getattr(compiled.history, name), stepped[name], err_msg=name)
    assert compiled.status == stepped["plant_status"][-1]
    assert_array_equal(compiled.saturated, stepped["saturated"])


def test_every_signal_of_the_loop_has_one_source_and_follows_it_within_a_step():
    outputs = [signal for each in LOOP for signal in each.outputs]
    assert len(outputs) == len({signal.name for signal in outputs})
    given: set[SignalType] = set()
    for each in LOOP:
        assert given.issuperset(each.inputs), each.name
        assert {*outputs}.issuperset((*each.delayed, *each.state)), each.name
        given.update(each.outputs)


def test_every_signal_of_the_loop_travels_on_a_topic_that_its_reader_subscribes_to():
    carried = {signal for fields in TOPIC_FIELDS.values() for signal in fields}
    assert carried == {s for each in LOOP for s in each.outputs}
    assert TOPIC_FIELDS.keys() == TOPICS.keys() - {CLOCK}
    for node in graph():
        if node.block:
            received = {signal for topic in node.subscribes for signal in TOPIC_FIELDS.get(topic, {})}
            assert received.issuperset(node.block.inputs), node.name

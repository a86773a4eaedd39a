"""Signals straight to bytes and back: the same as by way of messages, whatever they hold."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest

from hsv.control.nominal_law import NominalStatus
from hsv.control.tube_law import TubeResult, TubeStatusCode
from hsv.faults.schedule import ActiveFault
from hsv.faults.table import Fault
from hsv.graph.description import ACTUATOR, CARRIED, CLOCK, TOPICS
from hsv.graph.exchange import FILL, READ
from hsv.simulation.blocks import Signals
from hsv.vehicle.plant import FlightStatus
from hsv_node.codec import codec, plain_class
from hsv_node.wire import STEP_PLACE, TAKE, Head, giver, head_of

PERIOD = 0.02

LOSS = ActiveFault(Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": 0.9}), 12)
REVERSAL = ActiveFault(Fault.of("fuel_equivalence_ratio", "reversal", {"about_start": 1.0}), 3)


def signals_of(seed: int, *, sizes: tuple[int, int, int], active: tuple[ActiveFault, ...] = ()) -> Signals:
    """Return signals with numbers in every place; ``sizes``: of the filter, of a gain, of the tube's set."""
    draw = np.random.default_rng(seed)
    filter_size, gain_rows, tube_size = sizes
    signals = Signals()
    signals.step, signals.period = int(draw.integers(10_000)), PERIOD
    for name in ("state", "measurement", "reference", "deviation"):
        setattr(signals, name, draw.normal(size=9))
    for name in ("effector", "reference_input", "nominal_input", "command", "actuator"):
        setattr(signals, name, draw.normal(size=2))
    signals.estimate = draw.normal(size=9) if seed % 2 else signals.measurement
    signals.forces = tuple(draw.normal(size=5).tolist())
    signals.air = draw.normal(size=3)
    signals.status = FlightStatus(int(draw.integers(3)))
    signals.filtered_pitch_rate = float(draw.normal())
    signals.filter_state = draw.normal(size=filter_size)
    signals.gain = draw.normal(size=(gain_rows, 9))
    signals.gain_index, signals.nominal_status = int(draw.integers(256)), NominalStatus(int(draw.integers(16)))
    signals.saturated = draw.normal(size=2) > 0.0
    signals.active_faults = active
    signals.diagnostics = TubeResult(
        input=signals.command,
        u_unsaturated=draw.normal(size=2),
        error=draw.normal(size=5 + filter_size),
        tube_centre=draw.normal(size=tube_size),
        tube_half_width=draw.normal(size=tube_size),
        level=float("nan") if not tube_size else float(draw.normal()),
        inside=bool(tube_size),
        component="",
        u_feedback=draw.normal(size=2),
        u_nominal=signals.nominal_input,
        tau=draw.normal(size=1 + 4 * (seed % 2)),
        status=TubeStatusCode(int(draw.integers(6))),
    )
    return signals


CASES = [
    signals_of(0, sizes=(2, 0, 7)),
    signals_of(1, sizes=(0, 2, 0), active=(LOSS,)),
    signals_of(2, sizes=(4, 2, 9), active=(LOSS, REVERSAL)),
    signals_of(3, sizes=(8, 0, 0), active=(REVERSAL, LOSS)),
    signals_of(4, sizes=(2, 0, 7), active=(LOSS, REVERSAL)),
]


def by_message(topic: str, signals: Signals) -> bytes:
    """Return the bytes by way of a message."""
    header = plain_class("std_msgs/msg/Header")()
    header.stamp.sec, header.stamp.nanosec = Head.at(signals.step, PERIOD)[:2]
    signals.header = header
    message = plain_class(TOPICS[topic])()
    FILL[topic](signals, message, plain_class)
    return codec(TOPICS[topic]).encode(message)


def same(first: Any, second: Any) -> bool:
    """Compare signals: arrays by their bits and layout, for compiled functions take only those they were made for."""
    if isinstance(first, np.ndarray):
        layout = all(array.flags.c_contiguous and array.flags.aligned and array.flags.owndata for array in (second,))
        return layout and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    return bool(first == second)


@pytest.mark.parametrize("topic", TOPICS)
def test_the_bytes_are_those_of_the_message(topic):
    give = giver(topic)  # one for all: what it remembers of one message must not come back in another
    for signals in (*CASES, *reversed(CASES)):
        expected = by_message(topic, signals)
        signals.header = Head.at(signals.step, PERIOD)
        assert give(signals) == expected


@pytest.mark.parametrize("topic", TAKE)
def test_what_is_taken_is_what_the_message_says(topic):
    take, kind = TAKE[topic](), codec(TOPICS[topic])
    for given in (*CASES, *reversed(CASES)):
        data = by_message(topic, given)
        one, other = Signals(), Signals()
        READ[topic](kind.decode(data), one)
        take(kind.unpack(data), other)
        names = vars(one).keys() - {"header"}
        assert vars(other).keys() - {"header"} == names
        assert [name for name in names if not same(getattr(one, name), getattr(other, name))] == []
        assert (other.header.stamp.sec, other.header.stamp.nanosec) == (one.header.stamp.sec, one.header.stamp.nanosec)


def test_the_header_is_passed_on_as_it_came():
    kind = TOPICS[ACTUATOR]
    message = plain_class(kind)(step=7)
    message.header.frame_id = "body"
    values = codec(kind).unpack(codec(kind).encode(message))
    assert values[STEP_PLACE] == 7
    signals = signals_of(0, sizes=(2, 0, 7))
    signals.header = head_of(values)
    answer = codec(kind).decode(giver(ACTUATOR)(signals))
    assert answer.header == message.header


def test_every_step_topic_is_written_and_what_a_node_takes_is_read():
    assert {*CARRIED, CLOCK} == {*TOPICS}
    assert {*TAKE} < {*READ}


@pytest.mark.parametrize("more", [(), (0, 1)])
def test_values_that_are_not_as_many_as_their_lengths_say_are_refused(more):
    kind = codec(TOPICS[ACTUATOR])
    with pytest.raises((struct.error, IndexError)):
        kind.pack((0, 0, 1, b"\0", 3, 1.0, 2.0, 0, *more))

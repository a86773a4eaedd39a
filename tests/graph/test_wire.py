"""Signals to messages and back, in the nodes and in the replay: what rclpy reads and writes, whatever they hold."""

from __future__ import annotations

import random
import struct
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from flown_bags import types
from hsv_msgs import msg
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header

from hsv.bags import description
from hsv.bags.description import TOPICS, WIRE_ALIGNMENT
from hsv.bags.exchange import Head, filler, reader
from hsv.bags.fields import blank
from hsv.base.errors import RunError, SignalError
from hsv.control.nominal_law import NominalStatus
from hsv.control.tube_law import TubeResult, TubeStatusCode
from hsv.flight.blocks import Signals
from hsv.model.faults.schedule import ActiveFault
from hsv.model.faults.table import Fault
from hsv.model.plant import FlightStatus
from hsv_node.codec import codec
from hsv_node.messages import type_name
from hsv_node.wire import giver, taker

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


def head(step: int) -> Header:
    sec, nanosec = divmod(round(step * PERIOD * 1e9), 10**9)
    return Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id="body")


def longitudinal(x: np.ndarray) -> dict[str, Any]:
    h, V, alpha, theta, q, coordinate_1, rate_1, coordinate_2, rate_2 = map(float, x)
    return {
        "altitude": h,
        "velocity": V,
        "angle_of_attack": alpha,
        "pitch_angle": theta,
        "pitch_rate": q,
        "elastic_coordinate": [coordinate_1, coordinate_2],
        "elastic_rate": [rate_1, rate_2],
    }


def inputs(u: np.ndarray) -> dict[str, float]:
    return {"fuel_equivalence_ratio": float(u[0]), "elevator_deflection": float(u[1])}


def fault(acting: ActiveFault) -> msg.Fault:
    parameters = dict(acting.fault.parameters)
    return msg.Fault(
        channel=acting.fault.channel,
        type=acting.fault.type,
        parameter_names=list(parameters),
        parameter_values=list(parameters.values()),
    )


def typed(topic: str, signals: Signals) -> Any:
    """Return the message of rclpy that holds these signals, field by field."""
    s, tube = signals, signals.diagnostics
    place = {"header": head(s.step), "step": s.step}
    match topic:
        case description.CLOCK:
            return Clock(clock=place["header"].stamp)
        case description.MEASUREMENT:
            state = msg.LongitudinalState(**longitudinal(s.measurement))
            return msg.Measurement(**place, state=state, status=int(s.status))
        case description.STATE:
            return msg.VehicleState(**place, **longitudinal(s.state), status=int(s.status))
        case description.FORCES:
            names = ("lift", "drag", "thrust", "pitching_moment", "dynamic_pressure")
            air = ("wind_forward", "wind_up", "density_factor")
            return msg.VehicleForces(
                **place,
                **dict(zip(names, s.forces, strict=True)),
                effector=msg.InputVector(**inputs(s.effector)),
                **dict(zip(air, map(float, s.air), strict=True)),
            )
        case description.FILTERED_STATE:
            return msg.FilteredState(
                **place,
                state=msg.LongitudinalState(**longitudinal(s.measurement)),
                filtered_pitch_rate=s.filtered_pitch_rate,
                filter_state=s.filter_state,
                estimate=[] if s.estimate is s.measurement else s.estimate,
                status=int(s.status),
            )
        case description.NOMINAL:
            return msg.NominalState(
                **place,
                reference=msg.LongitudinalState(**longitudinal(s.reference)),
                reference_input=msg.InputVector(**inputs(s.reference_input)),
                deviation=msg.LongitudinalState(**longitudinal(s.deviation)),
                input=msg.InputVector(**inputs(s.nominal_input)),
                gain=[number for row in s.gain for number in row],
                gain_index=s.gain_index,
                status=int(s.nominal_status),
            )
        case description.COMMAND:
            return msg.ControlInput(**place, **inputs(s.command), saturated=[bool(limit) for limit in s.saturated])
        case description.TUBE_STATUS:
            return msg.TubeStatus(
                **place,
                error=tube.error,
                tube_centre=tube.tube_centre,
                tube_half_width=tube.tube_half_width,
                level=tube.level,
                inside=tube.inside,
                u_nominal=msg.InputVector(**inputs(tube.u_nominal)),
                u_feedback=msg.InputVector(**inputs(tube.u_feedback)),
                u_reference=msg.InputVector(**inputs(s.reference_input)),
                u_unsaturated=msg.InputVector(**inputs(tube.u_unsaturated)),
                tau=tube.tau,
                status=int(tube.status),
            )
        case description.ACTUATOR:
            since = [acting.since for acting in s.active_faults]
            return msg.Actuator(**place, **inputs(s.actuator), active=[*map(fault, s.active_faults)], since=since)
    raise AssertionError(topic)


def sent(message: Any) -> bytes:
    """Return the bytes of a message of rclpy as DDS sends them: with zeros between the fields, and no surplus."""
    kind = codec(type_name(type(message)))
    return kind.pack(kind.unpack(serialize_message(message))[1:])


TAKEN = {
    description.MEASUREMENT: {"measurement", "status"},
    description.STATE: {"state", "status"},
    description.FILTERED_STATE: {"measurement", "estimate", "filtered_pitch_rate", "filter_state", "status"},
    description.NOMINAL: {"reference", "reference_input", "deviation", "nominal_input"},
    description.COMMAND: {"command"},
    description.ACTUATOR: {"actuator", "active_faults"},
}
"""What a block needs of each topic, or passes on."""


def same(first: Any, second: Any) -> bool:
    """Compare signals: arrays by their bits and layout, for compiled functions take only those they were made for."""
    if isinstance(first, np.ndarray):
        layout = second.flags.c_contiguous and second.flags.aligned and second.flags.owndata
        return layout and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    return bool(first == second)


def assert_taken(topic: str, given: Signals, taken: Signals) -> None:
    assert vars(taken).keys() == TAKEN[topic] | {"header", "step"}
    assert [n for n in (*TAKEN[topic], "step") if not same(getattr(given, n), getattr(taken, n))] == []
    stamp, frame = taken.header.stamp, taken.header.frame_id
    assert ((stamp.sec, stamp.nanosec), frame) == (Head.at(given.step, PERIOD)[:2], "body")
    if topic == description.FILTERED_STATE:
        assert (taken.estimate is taken.measurement) == (given.estimate is given.measurement)


def headed(signals: Signals) -> Signals:
    signals.header = Head.at(signals.step, PERIOD)._replace(length=5, frame=b"body\0")
    return signals


@pytest.mark.parametrize("topic", TOPICS)
def test_the_bytes_of_a_node_are_those_of_rclpy(topic):
    give = giver(topic)  # one for all: what it remembers of one message must not come back in another
    for signals in (*CASES, *reversed(CASES)):
        assert give(headed(signals)) == sent(typed(topic, signals))


@pytest.mark.parametrize("topic", TAKEN)
def test_a_node_takes_what_rclpy_writes(topic):
    take, unpack = taker(topic), codec(TOPICS[topic]).unpack
    for given in (*CASES, *reversed(CASES)):
        taken = Signals()
        take(unpack(serialize_message(typed(topic, given))), taken)
        assert_taken(topic, given, taken)


@pytest.mark.parametrize("topic", TOPICS)
def test_the_bytes_of_the_replay_are_those_of_rclpy(topic):
    store = types()
    filled = blank(store, TOPICS[topic])  # one for all: what was in it before must not remain
    for signals in (*CASES, *reversed(CASES)):
        filler(topic)(headed(signals), filled)
        data = bytes(store.serialize_cdr(filled, TOPICS[topic]))
        assert data + bytes(-len(data) % WIRE_ALIGNMENT) == sent(typed(topic, signals))


@pytest.mark.parametrize("topic", TAKEN)
def test_the_replay_reads_what_rclpy_writes(topic):
    store = types()
    for given in CASES:
        taken = Signals()
        reader(topic)(store.deserialize_cdr(sent(typed(topic, given)), TOPICS[topic]), taken)
        assert_taken(topic, given, taken)


def test_a_bag_from_before_there_were_estimators_says_the_measurement_alone():
    signals = Signals()
    fields = vars(blank(types(), TOPICS[description.FILTERED_STATE]))
    former = SimpleNamespace(**{name: value for name, value in fields.items() if name != "estimate"})
    reader(description.FILTERED_STATE)(former, signals)
    assert signals.estimate is signals.measurement


def loss(**fields: Any) -> msg.Fault:
    """Return the message of a loss of effectiveness in which something may be wrong."""
    right = {"parameter_names": ["effectiveness"], "parameter_values": [0.9]}
    return msg.Fault(**{"channel": "elevator_deflection", "type": "loss_of_effectiveness"} | right | fields)


@pytest.mark.parametrize(
    ("topic", "message", "words"),
    [
        *(
            (
                description.FILTERED_STATE,
                msg.FilteredState(estimate=[1.0] * size),
                f"estimate: {size} numbers, expected 9",
            )
            for size in (1, 3, 8, 10)
        ),
        *(
            (
                description.FILTERED_STATE,
                msg.FilteredState(filter_state=[1.0] * size, estimate=[1.0] * 9),
                f"filter_state: {size} numbers, expected two a section of the notch filter",
            )
            for size in (1, 3)
        ),
        (description.NOMINAL, msg.NominalState(gain=[1.0] * 9), "gain: 9 numbers, expected 18, or none"),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss(parameter_values=[])], since=[3]),
            r"active\[0\]: fault\.parameter_values: 0 values, expected one a name, 1",
        ),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss(), loss(type="stuk")], since=[3, 3]),
            r"active\[1\]: fault\.type = 'stuk': expected one of ",
        ),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss(channel="rudder")], since=[3]),
            r"active\[0\]: fault\.channel = 'rudder': expected",
        ),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss(parameter_values=[float("nan")])], since=[3]),
            r"active\[0\]: fault\.effectiveness = nan: expected",
        ),
        (description.ACTUATOR, msg.Actuator(active=[loss()]), "since: 0 steps, expected one a fault in active, 1"),
        (description.ACTUATOR, msg.Actuator(since=[3]), "since: 1 steps, expected one a fault in active, 0"),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss()], since=[2**64 - 1]),
            r"since\[0\] = 18446744073709551615: expected a step, at most 4611686018427387904",
        ),
    ],
)
def test_what_no_block_can_take_is_refused_by_both_and_sets_no_signal(topic: str, message: Any, words: str) -> None:
    data, store = serialize_message(message), types()
    taken = Signals()
    with pytest.raises(SignalError, match=words) as refused:
        taker(topic)(codec(TOPICS[topic]).unpack(data), taken)
    assert description.TOPIC_OF[refused.value.signal] == topic
    with pytest.raises(SignalError, match=words):
        reader(topic)(store.deserialize_cdr(sent(message), TOPICS[topic]), taken)
    assert not vars(taken)


def test_a_message_after_one_that_was_refused_is_taken():
    unpack, take, taken = codec(TOPICS[description.ACTUATOR]).unpack, taker(description.ACTUATOR), Signals()
    good = unpack(serialize_message(typed(description.ACTUATOR, CASES[2])))
    take(good, taken)
    with pytest.raises(SignalError, match="since: 0 steps"):
        take(unpack(serialize_message(msg.Actuator(active=[loss()]))), taken)
    assert taken.active_faults == (LOSS, REVERSAL) and taken.step == CASES[2].step
    take(good, taken)
    assert taken.active_faults == (LOSS, REVERSAL)


def test_an_empty_text_of_no_bytes_shifts_nothing():
    """Some write an empty text as the length 0, without the zero that ends it."""
    for topic in TAKEN:
        taken, given = Signals(), CASES[2]
        kind = codec(TOPICS[topic])
        values = kind.unpack(serialize_message(typed(topic, given)))
        data = kind.pack((*values[1:3], 0, b"", *values[5:]))
        assert len(data) < len(kind.pack(values[1:])) and data[12:16] == bytes(4)
        taker(topic)(kind.unpack(data), taken)
        assert [n for n in (*TAKEN[topic], "step") if not same(getattr(given, n), getattr(taken, n))] == []
        assert taken.header.frame_id == ""


def test_of_whatever_numbers_no_other_error_is_raised_than_that_of_a_signal():
    draw = random.Random(0)
    for topic in TAKEN:
        take, kind = taker(topic), codec(TOPICS[topic])
        for _ in range(300):
            data = bytearray(sent(typed(topic, draw.choice(CASES))))
            for _ in range(draw.randrange(1, 4)):
                data[draw.randrange(4, len(data))] = draw.choice([0, 1, 2, 4, draw.randrange(256)])
            taken = Signals()
            try:
                take(kind.unpack(bytes(data)), taken)
            except RunError as error:
                assert isinstance(error, SignalError) or str(error).startswith(TOPICS[topic])
                assert not vars(taken)


@pytest.mark.parametrize("more", [(), (0, 1)])
def test_values_that_are_not_as_many_as_their_lengths_say_are_refused(more):
    kind = codec(TOPICS[description.ACTUATOR])
    with pytest.raises((struct.error, IndexError)):
        kind.pack((0, 0, 1, b"\0", 3, 1.0, 2.0, 0, *more))

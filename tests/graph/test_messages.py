"""Conversion of signals to messages and back gives the same numbers and bytes as rclpy, for any content."""

import random

import numpy as np
import pytest
from hsv_msgs import msg
from rclpy.serialization import deserialize_message, serialize_message
from recorded_flight import message_types

from hsv.bags import description
from hsv.bags.columns import Track
from hsv.bags.definitions import deserialized
from hsv.bags.description import INTERFACE_VERSION, TOPICS, WIRE_ALIGNMENT
from hsv.bags.messages import FRAME, MessageError, StepMessages, stamp_in, stamp_of
from hsv.base.errors import SignalError
from hsv.control.nominal_law import NominalStatus
from hsv.control.tube_law import TubeResult, TubeStatusCode
from hsv.flight.blocks import Signals
from hsv.model.faults.schedule import ActiveFault
from hsv.model.faults.table import Fault
from hsv.model.plant import FlightStatus
from hsv.model.signals import STATE_NAMES
from hsv_node.middleware import message_class

PERIOD = 0.02

STORE = message_types()

LOSS = ActiveFault(Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": 0.9}), 12)
REVERSAL = ActiveFault(Fault.of("fuel_equivalence_ratio", "reversal", {"about_start": 1.0}), 3)


def signals_of(seed, *, sizes, active=()):
    """Return signals without zeros; ``sizes`` are those of the filter, of a gain, and of the tube's set."""
    draw = np.random.default_rng(seed)
    filter_size, gain_rows, tube_size = sizes
    signals = Signals()
    signals.step, signals.period = int(draw.integers(10_000)), PERIOD
    signals.stamp = stamp_of(signals.step, PERIOD)
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


def typed(topic, signals, frame=FRAME):
    """Return the rclpy message that holds these signals."""
    message = deserialize_message(StepMessages(topic).pack(signals), message_class(TOPICS[topic]))
    if topic != description.CLOCK:
        message.header.frame_id = frame
    return message


def sent(message):
    """Return the bytes of an rclpy message as DDS sends them: padding of zeros, nothing after the last field."""
    kind = "/".join((*type(message).__module__.split(".")[:2], type(message).__name__))
    data = bytes(STORE.serialize_cdr(deserialized(STORE, serialize_message(message), kind), kind))
    return data + bytes(-len(data) % WIRE_ALIGNMENT)


NEEDED = {
    description.MEASUREMENT: {"measurement", "status"},
    description.STATE: {"state", "status"},
    description.FILTERED_STATE: {"measurement", "estimate", "filtered_pitch_rate", "filter_state", "status"},
    description.NOMINAL: {"reference", "reference_input", "deviation", "nominal_input"},
    description.COMMAND: {"command"},
    description.ACTUATOR: {"actuator", "active_faults"},
}
"""The signals of each topic that a block uses or passes on."""


def same(first, second):
    """Compare signals, arrays by their bits. The core needs aligned arrays."""
    if isinstance(first, np.ndarray):
        aligned = second.flags.c_contiguous and second.ctypes.data % 8 == 0
        return aligned and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    return bool(first == second)


def assert_unpacked(topic, given, unpacked):
    assert vars(unpacked).keys() == NEEDED[topic] | {"stamp", "step"}
    assert [n for n in (*NEEDED[topic], "step", "stamp") if not same(getattr(given, n), getattr(unpacked, n))] == []
    if topic == description.FILTERED_STATE:
        assert (unpacked.estimate is unpacked.measurement) == (given.estimate is given.measurement)


def test_the_interface_version_is_that_of_the_messages():
    assert msg.Run.INTERFACE_VERSION == INTERFACE_VERSION


@pytest.mark.parametrize(
    ("codes", "message"),
    [(TubeStatusCode, msg.TubeStatus), (NominalStatus, msg.NominalState), (FlightStatus, msg.VehicleState)],
)
def test_codes_are_the_constants_of_the_messages(codes, message):
    values = {name: code.value for name, code in codes.__members__.items()}
    assert values == {name: getattr(message, name) for name in values}


@pytest.mark.parametrize("topic", TOPICS)
def test_packed_bytes_are_those_of_rclpy(topic):
    messages = StepMessages(topic)  # one object for all: no message may leave anything for the next
    for signals in (*CASES, *reversed(CASES)):
        data = messages.pack(signals)
        assert data == sent(typed(topic, signals))
        assert stamp_in(data) == signals.stamp[0] * 10**9 + signals.stamp[1]


def test_packed_signals_are_in_the_fields_of_their_names():
    given = CASES[2]
    nominal, forces, tube = (
        typed(topic, given) for topic in (description.NOMINAL, description.FORCES, description.TUBE_STATUS)
    )
    assert [getattr(nominal.deviation, name) for name in STATE_NAMES] == given.deviation.tolist()
    assert [getattr(nominal.reference, name) for name in STATE_NAMES] == given.reference.tolist()
    assert nominal.gain.tolist() == given.gain.ravel().tolist() and nominal.gain_index == given.gain_index
    names = ("lift", "drag", "thrust", "pitching_moment", "dynamic_pressure", "wind_forward", "wind_up")
    assert [getattr(forces, name) for name in names] == [*given.forces, *given.air[:2]]
    found = given.diagnostics
    assert [tube.u_feedback.fuel_equivalence_ratio, tube.u_feedback.elevator_deflection] == found.u_feedback.tolist()
    assert (tube.level, tube.status, tube.tau.tolist()) == (found.level, found.status, found.tau.tolist())
    assert tube.tube_half_width.tolist() == found.tube_half_width.tolist()


@pytest.mark.parametrize("topic", NEEDED)
@pytest.mark.parametrize("frame", [FRAME, "", "body"])
def test_unpacked_signals_are_those_that_rclpy_wrote(topic, frame):
    messages = StepMessages(topic)
    for given in (*CASES, *reversed(CASES)):
        unpacked, data = Signals(), serialize_message(typed(topic, given, frame))
        assert messages.step(data) == given.step
        messages.unpack(data, unpacked)
        assert_unpacked(topic, given, unpacked)


def test_the_surplus_behind_faults_without_parameters_is_accepted():
    frozen = [ActiveFault(Fault.of("elevator_deflection", "lock_in_place", {}), since) for since in (7, 8, 9, 10)]
    surplus = set()
    for count in range(1, len(frozen) + 1):
        unpacked, kind = Signals(), TOPICS[description.ACTUATOR]
        given = signals_of(1, sizes=(2, 2, 7), active=tuple(frozen[:count]))
        data = serialize_message(typed(description.ACTUATOR, given))
        surplus.add(len(data) - len(sent(typed(description.ACTUATOR, given))))
        StepMessages(description.ACTUATOR).unpack(data, unpacked)
        assert unpacked.active_faults == given.active_faults
        columns = Track("/hsv/actuator", kind, STORE, [0], [data]).columns()
        assert columns["since"].tolist() == [[7, 8, 9, 10][:count]]
    assert max(surplus) > 3, "nothing to accept"


def test_an_empty_text_may_lack_its_closing_zero():
    topic, given, unpacked = description.COMMAND, CASES[2], Signals()
    data = sent(typed(topic, given, ""))
    # With the closing zero the length is 1, followed by the zero and three bytes of padding.
    assert data[12:20] == bytes([1, 0, 0, 0, 0, 0, 0, 0])
    StepMessages(topic).unpack(data[:12] + bytes(8) + data[20:], unpacked)
    assert_unpacked(topic, given, unpacked)


@pytest.mark.parametrize("topic", NEEDED)
def test_messages_cut_short_or_of_another_byte_order_are_refused(topic):
    whole, messages = sent(typed(topic, CASES[2])), StepMessages(topic)
    with pytest.raises(MessageError, match="begins with 0000, expected 0001, little-endian"):
        messages.unpack(b"\0\0" + whole[2:], Signals())
    for length in range(len(whole) - 3):
        with pytest.raises(MessageError, match=TOPICS[topic]):
            messages.unpack(whole[:length], Signals())


def test_a_length_beyond_the_message_is_refused_at_once():
    whole = bytearray(sent(typed(description.FILTERED_STATE, CASES[0])))
    whole[12:16] = b"\xff\xff\xff\x7f"
    with pytest.raises(MessageError, match=r"header\.frame_id: length 2147483647 in a message of"):
        StepMessages(description.FILTERED_STATE).unpack(bytes(whole), Signals())


def loss(since=(3,), **fields):
    """Return the message of a loss of effectiveness, with ``fields`` that may be wrong."""
    right = {"parameter_names": ["effectiveness"], "parameter_values": [0.9]}
    acting = msg.Fault(**{"channel": "elevator_deflection", "type": "loss_of_effectiveness"} | right | fields)
    return msg.Actuator(active=[acting], since=since)


@pytest.mark.parametrize(
    ("topic", "message", "words"),
    [
        (description.FILTERED_STATE, msg.FilteredState(estimate=[1.0] * 8), "estimate: 8 numbers, expected 9"),
        (description.FILTERED_STATE, msg.FilteredState(filter_state=[1.0]), "filter_state: 1 numbers, expected two"),
        (description.NOMINAL, msg.NominalState(gain=[1.0] * 9), "gain: 9 numbers, expected 18, or none"),
        (description.ACTUATOR, loss(parameter_values=[]), r"fault\.parameter_values: 0 values, expected 1, one for"),
        (description.ACTUATOR, loss(type="stuk"), r"active\[0\]: fault\.type = 'stuk': expected one of "),
        (description.ACTUATOR, loss(channel="rudder"), r"active\[0\]: fault\.channel = 'rudder': expected"),
        (description.ACTUATOR, loss(parameter_values=[float("nan")]), r"fault\.effectiveness = nan: expected"),
        (description.ACTUATOR, loss(since=()), "since: 0 steps, expected 1, one for each fault in active"),
        (description.ACTUATOR, loss(since=(2**64 - 1,)), r"since\[0\] = 18446744073709551615: expected a step, at"),
    ],
)
def test_unusable_signals_are_refused_and_none_is_set(topic, message, words):
    unpacked = Signals()
    with pytest.raises(SignalError, match=words) as refused:
        StepMessages(topic).unpack(sent(message), unpacked)
    assert description.TOPIC_OF[refused.value.signal] == topic
    assert not vars(unpacked)


def test_random_bytes_raise_no_other_error():
    draw = random.Random(0)
    for topic in NEEDED:
        messages = StepMessages(topic)
        for _ in range(300):
            data = bytearray(sent(typed(topic, draw.choice(CASES))))
            for _ in range(draw.randrange(1, 4)):
                data[draw.randrange(4, len(data))] = draw.choice([0, 1, 2, 4, draw.randrange(256)])
            del data[draw.randrange(len(data) - 4, len(data) + 1) :]
            unpacked = Signals()
            try:
                messages.unpack(bytes(data), unpacked)
            except (MessageError, SignalError):
                assert not vars(unpacked)

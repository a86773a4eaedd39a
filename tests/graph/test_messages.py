"""Signals to messages and back: the same numbers and bytes as those of rclpy, whatever the messages hold."""

from __future__ import annotations

import random
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
from hsv.bags.columns import Track
from hsv.bags.description import INTERFACE_VERSION, TOPICS, WIRE_ALIGNMENT
from hsv.bags.messages import FRAME, MessageError, StepMessages, Structure, stamp_in, stamp_of
from hsv.bags.typestore import deserialized
from hsv.base.errors import SignalError
from hsv.control.nominal_law import NominalStatus
from hsv.control.tube_law import TubeResult, TubeStatusCode
from hsv.flight.blocks import Signals
from hsv.model.faults.schedule import ActiveFault
from hsv.model.faults.table import Fault
from hsv.model.plant import FlightStatus
from hsv.model.signals import STATE_NAMES

PERIOD = 0.02

STORE = types()

LOSS = ActiveFault(Fault.of("elevator_deflection", "loss_of_effectiveness", {"effectiveness": 0.9}), 12)
REVERSAL = ActiveFault(Fault.of("fuel_equivalence_ratio", "reversal", {"about_start": 1.0}), 3)


def signals_of(seed: int, *, sizes: tuple[int, int, int], active: tuple[ActiveFault, ...] = ()) -> Signals:
    """Return signals with numbers in every place; ``sizes``: of the filter, of a gain, of the tube's set."""
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


def header(step: int, frame: str = FRAME) -> Header:
    sec, nanosec = divmod(round(step * PERIOD * 1e9), 10**9)
    return Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=frame)


def longitudinal(x: np.ndarray) -> dict[str, float]:
    return dict(zip(STATE_NAMES, map(float, x), strict=True))


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


def typed(topic: str, signals: Signals, frame: str = FRAME) -> Any:
    """Return the message of rclpy that holds these signals, field by field."""
    s, tube = signals, signals.diagnostics
    place = {"header": header(s.step, frame), "step": s.step}
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
"""The signals of each topic that a block needs, or passes on."""


def same(first: Any, second: Any) -> bool:
    """Compare signals: arrays by their bits; the core needs them aligned."""
    if isinstance(first, np.ndarray):
        aligned = second.flags.c_contiguous and second.ctypes.data % 8 == 0
        return aligned and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    return bool(first == second)


def assert_unpacked(topic: str, given: Signals, unpacked: Signals) -> None:
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
    messages = StepMessages(topic)  # one for all: nothing of one message may remain in the next
    for signals in (*CASES, *reversed(CASES)):
        data = messages.pack(signals)
        assert data == sent(typed(topic, signals))
        assert stamp_in(data) == signals.stamp[0] * 10**9 + signals.stamp[1]


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
    # With the closing zero the length is 1, and three bytes of padding follow.
    assert data[12:20] == bytes([1, 0, 0, 0, 0, 0, 0, 0])
    StepMessages(topic).unpack(data[:12] + bytes(8) + data[20:], unpacked)
    assert_unpacked(topic, given, unpacked)


@pytest.mark.parametrize("topic", TOPICS)
def test_a_structure_reads_a_whole_topic(topic):
    kind = TOPICS[topic]
    messages = [sent(typed(topic, signals_of(seed, sizes=(2, 0, 7)))) for seed in (1, 3, 5)]
    structure = Structure(STORE.fielddefs, kind, messages[0])
    assert structure.complete and len(messages[0]) - 4 - structure.size < WIRE_ALIGNMENT
    rows = structure.rows(messages)
    for row, message in zip(rows, messages, strict=True):
        read = STORE.deserialize_cdr(message, kind)
        for path in structure.dtype.names:
            value = read
            for name in path.split("."):
                value = getattr(value, name)
            found = row[path].decode() if isinstance(value, str) else row[path].tolist()
            np.testing.assert_array_equal(found.rstrip("\0") if isinstance(value, str) else found, value)
    assert structure.rows([*messages, messages[0] + bytes(4)]) is None


def test_a_structure_ends_where_a_list_of_messages_begins():
    kind = TOPICS[description.ACTUATOR]
    data = sent(typed(description.ACTUATOR, CASES[1]))
    structure = Structure(STORE.fielddefs, kind, data)
    assert not structure.complete and structure.dtype.names[-1] == "elevator_deflection"
    assert not structure.fits(sent(typed(description.STATE, CASES[1]))[:40])


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
                f"filter_state: {size} numbers, expected two for each section of the notch filter",
            )
            for size in (1, 3)
        ),
        (description.NOMINAL, msg.NominalState(gain=[1.0] * 9), "gain: 9 numbers, expected 18, or none"),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss(parameter_values=[])], since=[3]),
            r"active\[0\]: fault\.parameter_values: 0 values, expected 1, one for each name",
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
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss()]),
            "since: 0 steps, expected 1, one for each fault in active",
        ),
        (description.ACTUATOR, msg.Actuator(since=[3]), "since: 1 steps, expected 0, one for each fault in active"),
        (
            description.ACTUATOR,
            msg.Actuator(active=[loss()], since=[2**64 - 1]),
            r"since\[0\] = 18446744073709551615: expected a step, at most 4611686018427387904",
        ),
    ],
)
def test_unusable_signals_are_refused_and_none_is_set(topic: str, message: Any, words: str) -> None:
    unpacked = Signals()
    with pytest.raises(SignalError, match=words) as refused:
        StepMessages(topic).unpack(sent(message), unpacked)
    assert description.TOPIC_OF[refused.value.signal] == topic
    assert not vars(unpacked)


def test_a_message_after_a_refused_one_is_unpacked():
    messages, unpacked = StepMessages(description.ACTUATOR), Signals()
    good = sent(typed(description.ACTUATOR, CASES[2]))
    messages.unpack(good, unpacked)
    with pytest.raises(SignalError, match="since: 0 steps"):
        messages.unpack(sent(msg.Actuator(active=[loss()])), unpacked)
    assert unpacked.active_faults == (LOSS, REVERSAL) and unpacked.step == CASES[2].step
    messages.unpack(good, unpacked)
    assert unpacked.active_faults == (LOSS, REVERSAL)


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

"""Messages of the installed definitions with random contents, serialised without ROS."""

from types import SimpleNamespace

import numpy as np
import pytest
from recorded_flight import MESSAGES, message_types

from hsv.bags.definitions import definition, fields_of, type_hash
from hsv.bags.metadata import Topic, usual_qos

TYPES = [f"hsv_msgs/msg/{path.stem}" for path in sorted(MESSAGES.glob("*.msg"))]
LATCHED = usual_qos(1, latched=True)


@pytest.fixture(scope="session")
def store():
    return message_types()


def topic(name, message_type, qos=None):
    return Topic(name, message_type, definition(message_type), type_hash(message_type), qos or usual_qos())


class Messages:
    """Makes messages with random contents and serialises them."""

    def __init__(self, store):
        self.store = store
        self.random = np.random.default_rng(7)

    def serialize(self, message):
        return bytes(self.store.serialize_cdr(message, message.__msgtype__))

    def make(self, message_type, length=None, **given):
        """Return a message; ``length`` fixes the length of its sequences and text."""
        values = {
            field.name: given.get(field.name, self._value(field, length))
            for field in fields_of(self.store.fielddefs, message_type)
        }
        return self.store.types[message_type](**values)

    def time(self, time_ns):
        sec, nanosec = divmod(time_ns, 10**9)
        return self.store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)

    def stamped(self, message_type, time_ns, step, **given):
        header = self.store.types["std_msgs/msg/Header"](stamp=self.time(time_ns), frame_id="")
        return self.serialize(self.make(message_type, header=header, step=step, **given))

    def fault(self, effectiveness, channel="elevator_deflection"):
        """Return the message of an elevator fault, a loss of effectiveness."""
        return self.store.types["hsv_msgs/msg/Fault"](
            channel=channel,
            type="loss_of_effectiveness",
            parameter_names=["effectiveness"],
            parameter_values=np.array([effectiveness]),
        )

    def _value(self, field, length):
        some = int(self.random.integers(0, 6)) if length is None else length
        if field.count == "one":
            return self._numbers(field, 1)[0].item() if field.format else self._single(field, length, some)
        count = field.length if field.count == "array" else some
        if field.format:
            return self._numbers(field, count)
        return [self._single(field, length, some) for _ in range(count)]

    def _single(self, field, length, some):
        return "".join(self.random.choice(list("abcxyz"), some)) if field.is_text else self.make(field.type, length)

    def _numbers(self, field, count):
        kind = np.dtype(field.format)
        if kind.kind == "f":
            values = self.random.normal(size=count) * 10.0 ** self.random.integers(-9, 9, count)
            return np.where(self.random.random(count) < 0.1, np.nan, values).astype(kind)
        if kind.kind == "b":
            return self.random.random(count) < 0.5
        limits = np.iinfo(kind)
        return self.random.integers(limits.min, limits.max, count, dtype=kind, endpoint=True)


@pytest.fixture
def messages(store):
    return Messages(store)


@pytest.fixture
def kit(messages):
    """Return the helpers that the tests here share; test folders are no packages, so they cannot be imported."""
    return SimpleNamespace(messages=messages, topic=topic, latched=LATCHED, types=TYPES)

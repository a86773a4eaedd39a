"""Real message definitions, installed as ROS 2 installs them, and messages of them serialized without ROS."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from hsv.bags.definitions import definition, type_hash
from hsv.bags.topic import Qos, Topic
from hsv.bags.typestore import Field, fields_of

MESSAGES = Path(__file__).parents[2] / "ros_ws" / "src" / "hsv_msgs" / "msg"
STANDARD = {
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec\n",
    "rosgraph_msgs/msg/Clock": "builtin_interfaces/Time clock\n",
}
TYPES = [f"hsv_msgs/msg/{path.stem}" for path in sorted(MESSAGES.glob("*.msg"))]
LATCHED = Qos(depth=1, durability="transient_local")


@pytest.fixture(scope="session")
def store() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for name in TYPES:
        types |= get_types_from_msg((MESSAGES / f"{Path(name).name}.msg").read_text(), name)
    store.register(types)
    return store


@pytest.fixture(scope="session")
def prefix(tmp_path_factory: pytest.TempPathFactory, store: Typestore) -> Path:
    """An ament prefix with our messages and those they depend on, type descriptions included."""
    prefix = tmp_path_factory.mktemp("prefix")
    texts = STANDARD | {name: (MESSAGES / f"{Path(name).name}.msg").read_text() for name in TYPES}
    for name, text in texts.items():
        file = prefix / "share" / f"{name}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        hashes = {"type_hashes": [{"type_name": name, "hash_string": store.hash_rihs01(name)}]}
        file.with_suffix(".json").write_text(json.dumps(hashes))
    return prefix


@pytest.fixture(autouse=True)
def ament(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))


def topic(name: str, message_type: str, qos: Qos | None = None) -> Topic:
    return Topic(name, message_type, definition(message_type), type_hash(message_type), qos or Qos())


class Messages:
    """Makes messages with random contents and serializes them."""

    def __init__(self, store: Typestore) -> None:
        self.store = store
        self.random = np.random.default_rng(7)

    def serialize(self, message: Any) -> bytes:
        return bytes(self.store.serialize_cdr(message, message.__msgtype__))

    def make(self, message_type: str, length: int | None = None, **given: Any) -> Any:
        """Make a message; ``length`` fixes that of sequences and text."""
        values = {
            field.name: given.get(field.name, self._value(field, length))
            for field in fields_of(self.store.fielddefs, message_type)
        }
        return self.store.types[message_type](**values)

    def time(self, time_ns: int) -> Any:
        sec, nanosec = divmod(time_ns, 10**9)
        return self.store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)

    def stamped(self, message_type: str, time_ns: int, step: int, **given: Any) -> bytes:
        header = self.store.types["std_msgs/msg/Header"](stamp=self.time(time_ns), frame_id="")
        return self.serialize(self.make(message_type, header=header, step=step, **given))

    def fault(self, effectiveness: float, channel: str = "elevator_deflection") -> Any:
        """Make a loss of effectiveness."""
        return self.store.types["hsv_msgs/msg/Fault"](
            channel=channel,
            type="loss_of_effectiveness",
            parameter_names=["effectiveness"],
            parameter_values=np.array([effectiveness]),
        )

    def _value(self, field: Field, length: int | None) -> Any:
        some = int(self.random.integers(0, 6)) if length is None else length
        if field.count == "one":
            return self._numbers(field, 1)[0].item() if field.format else self._single(field, length, some)
        count = field.length if field.count == "array" else some
        if field.format:
            return self._numbers(field, count)
        return [self._single(field, length, some) for _ in range(count)]

    def _single(self, field: Field, length: int | None, some: int) -> Any:
        return "".join(self.random.choice(list("abcxyz"), some)) if field.is_text else self.make(field.type, length)

    def _numbers(self, field: Field, count: int) -> np.ndarray:
        kind = np.dtype(field.format)
        if kind.kind == "f":
            values = self.random.normal(size=count) * 10.0 ** self.random.integers(-9, 9, count)
            return np.where(self.random.random(count) < 0.1, np.nan, values).astype(kind)
        if kind.kind == "b":
            return self.random.random(count) < 0.5
        limits = np.iinfo(kind)
        return self.random.integers(limits.min, limits.max, count, dtype=kind, endpoint=True)


@pytest.fixture
def messages(store: Typestore) -> Messages:
    return Messages(store)


@pytest.fixture
def kit(messages: Messages) -> SimpleNamespace:
    """What the tests here share, by name, because test folders are no packages."""
    return SimpleNamespace(messages=messages, topic=topic, latched=LATCHED, types=TYPES)

"""Independent readers of bags: each returns topic, time (ns) and message as plain data."""

import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from hsv.bags.definitions import as_dict
from hsv.bags.reader import Bag

NPM = Path(__file__).parents[1] / "viewers" / "npm"


def ours(bag):
    opened = Bag(bag)
    for topic, recorded in opened.topics.items():
        for time, message in opened.decode(topic):
            yield topic, time, as_dict(opened.types.fielddefs, recorded.type, message)


def by_mcap_ros2(bag):
    with next(bag.glob("*.mcap")).open("rb") as stream:
        for item in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            yield item.channel.topic, item.message.log_time, _plain(item.decoded_message)


def by_foxglove(bag):
    node = shutil.which("node")
    if not node or not (NPM / "node_modules").is_dir():
        pytest.skip(f"no {'node_modules' if node else 'node'}; make test-viewers installs it")
    done = subprocess.run(
        [node, str(NPM / "read_bag.mjs"), str(next(bag.glob("*.mcap")))], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines():
        topic, time, message = json.loads(line)
        yield topic, int(time), message


READERS = [
    pytest.param(by_mcap_ros2, id="mcap-ros2-support"),
    pytest.param(by_foxglove, id="foxglove", marks=pytest.mark.viewer),
]
"""The readers, for parametrised tests."""


def assert_equal(expected, actual):
    """Assert that two readers return the same, except for the order of topics; return the number of messages."""
    first, second = (sorted(messages, key=lambda message: message[0]) for messages in (expected, actual))
    for message, other in zip(first, second, strict=True):
        assert _alike(list(message), list(other)), (message, other)
    return len(first)


def _alike(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(_alike(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(_alike(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(b, str) and not isinstance(a, str):
        # JSON has no NaN, no infinity and no 64-bit integers.
        b = float(b) if isinstance(a, float) else int(b)
    return bool(a == b) or (isinstance(a, float) and math.isnan(a) and math.isnan(b))


def _plain(value):
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if hasattr(value, "sec") and hasattr(value, "nanosec"):
        return value.sec * 10**9 + value.nanosec
    if hasattr(value, "__slots__"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value

"""Bags with random damage: every intact chunk is read, losses are reported, and no file is changed in place."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from damaged_bags import damaged, found_in, original
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from hsv.bags.reader import Bag
from hsv.bags.steps import bag_warnings
from hsv.base.errors import RecordingError

Hsv = Callable[..., Any]
REFERENCES = Path(__file__).parents[2] / "bags" / "reference"
QUICK = 2
LONG = 60


@pytest.fixture(scope="module")
def originals():
    return [original(folder) for folder in sorted(REFERENCES.iterdir()) if folder.is_dir()]


@pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(LONG, LONG + QUICK), id=f"{QUICK} bags"),
        pytest.param(range(LONG), id=f"{LONG} bags", marks=[pytest.mark.long, pytest.mark.timeout(3600)]),
    ],
)
def test_every_whole_chunk_is_read_and_what_is_lost_is_said(hsv, tmp_path, originals, seeds):
    read = 0
    for seed in seeds:
        source = originals[seed // 5 % len(originals)]
        path = tmp_path / f"bag{seed}"
        what, data = damaged(source, path, seed)
        before = {file.name: file.read_bytes() for file in path.iterdir()}
        try:
            bag = Bag(path)
        except RecordingError as error:
            assert not source.defines(data) or not source.whole(data), f"{what}: {error}"
            assert "\n" not in str(error)
            assert hsv("recover", str(path)).code == 2
            continue
        read += 1
        found = found_in(bag)
        if source.defines(data):
            assert source.whole(data) <= found, f"{what}: a whole chunk is not read"
        assert found <= source.messages, f"{what}: messages that nobody recorded"
        said = bag_warnings(bag)
        lost = (source.messages - found).total()
        if lost:
            assert said, what
        if bag.loss.counted and (bag.complete or "metadata.yaml" in before):
            assert bag.loss.messages == lost, what
        assert bag.loss.messages <= lost, what
        missing = source.attachments.keys() - bag.attachments.keys()
        assert not missing or bag.loss or not bag.complete, what
        assert bag.attachments.items() <= source.attachments.items(), what

        ran = hsv("info", str(path), "--json")
        assert ran.code in (0, 2) and "Traceback" not in ran.err, f"{what}: {ran.err}"
        assert ran.code == 2 or bool(said) == bool(ran.err), what
        target = tmp_path / f"new{seed}"
        ran = hsv("recover", str(path), "--out", str(target), "--json")
        assert ran.code == 0, f"{what}: {ran.err}"
        report = json.loads(ran.out)
        assert report["lost_messages"] == bag.loss.messages and report["messages"] == found.total(), what
        assert {file.name: file.read_bytes() for file in path.iterdir()} == before, f"{what}: changed in place"
        if report["changed"]:
            _is_whole(target, found.total(), read_through=seed % 10 == 0)
            again = Bag(target)
            assert found_in(again) == found and again.attachments == bag.attachments and not again.loss, what
        else:
            assert not lost and not bag.loss, what
    assert read > 0.8 * len(seeds)


def _is_whole(bag, messages, read_through):
    """Assert that other readers accept the bag; ``read_through`` also reads all messages with checksums, slowly."""
    with Reader(bag) as reader:
        assert reader.message_count == messages
    if read_through:
        with next(bag.glob("*.mcap")).open("rb") as stream:
            assert sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages()) == messages

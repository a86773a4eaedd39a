"""Other people's readers find in a bag what ours finds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from bag_readers import READERS, Messages, assert_equal, ours

from hsv.bags.writer import BagWriter

MESSAGES = 40


@pytest.fixture
def bag(kit: SimpleNamespace, tmp_path: Path) -> Path:
    """A bag with random messages of all our types."""
    names = {f"/hsv/any_{name.rpartition('/')[2].lower()}": name for name in kit.types}
    writer = BagWriter(tmp_path / "bag", [kit.topic(name, kind) for name, kind in names.items()])
    for k in range(MESSAGES):
        for name, kind in names.items():
            writer.write(name, k * 20_000_000, kit.messages.serialize(kit.messages.make(kind)))
    writer.close()
    return tmp_path / "bag"


@pytest.mark.parametrize("read", READERS)
def test_values_are_equal(bag: Path, kit: SimpleNamespace, read: Callable[[Path], Messages]) -> None:
    assert assert_equal(ours(bag), read(bag)) == MESSAGES * len(kit.types)

"""Bags whose topics, definitions or attachments are not as hsv writes them: one line, and exit code 2."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from changed_bags import changed_bag
from flown_bags import flown_bag

from hsv.bags.reader import Bag
from hsv.bags.topic import Topic

Hsv = Callable[..., Any]
COMMAND, FORCES = "/hsv/command", "/hsv/forces"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return flown_bag(tmp_path_factory.mktemp("bags") / "flown", duration=11.0, fault=1.0)


def _with(name: str, **changes: str) -> Callable[[Topic], Topic]:
    return lambda topic: replace(topic, **changes) if topic.name == name else topic


def _renamed(kind: str, field: str) -> Callable[[Topic], Topic]:
    """Return what gives a field of a message type another name, as an older definition might."""
    return lambda topic: (
        replace(topic, definition=topic.definition.replace(f" {field} ", " other ")) if topic.type == kind else topic
    )


@pytest.mark.parametrize(
    ("command", "change", "said"),
    [
        (
            "info",
            _with(COMMAND, type="std_msgs/msg/Float64", definition="float64 data\n"),
            "is std_msgs/msg/Float64, expected",
        ),
        ("replay", _with(FORCES, definition="Nowhere other\n"), "unknown type hsv_msgs/msg/Nowhere"),
        ("plot", _with(FORCES, definition="VehicleForces again\n"), "VehicleForces holds itself"),
        ("report", _with(FORCES, definition="no message\0"), "definition of hsv_msgs/msg/VehicleForces: "),
        ("diff", _with(COMMAND, type="ControlInput"), "expected hsv_msgs/msg/ControlInput"),
        ("export", _with(COMMAND, type="ControlInput"), "expected hsv_msgs/msg/ControlInput"),
    ],
    ids=["other type", "unknown type", "holds itself", "no definition", "no package", "no package, exported"],
)
def test_a_topic_of_another_type_or_definition(
    hsv: Hsv, bag: Path, tmp_path: Path, command: str, change: Callable[[Topic], Topic], said: str
) -> None:
    made = changed_bag(bag, tmp_path / "made", change)
    words = {"diff": [str(bag)], "export": ["--csv"]}.get(command, [])
    ran = hsv(command, str(made), *words)
    assert ran.code == 2 and said in ran.error and str(made) in ran.error


def test_definitions_may_have_the_line_ends_of_windows_or_be_empty(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    def written(topic: Topic) -> Topic:
        if topic.name == "/rosout":
            return replace(topic, type="std_msgs/msg/Empty", definition="")
        return replace(topic, definition=topic.definition.replace("\n", "\r\n"))

    made = changed_bag(bag, tmp_path / "made", written)
    assert "identical" in hsv("diff", str(bag), str(made)).out
    assert hsv("info", str(made)).code == 0
    assert hsv("export", str(made), "--csv", "--topic", "/hsv/state", "--out", "tables").code == 0
    assert '"altitude [m]"' in (tmp_path / "tables" / "hsv_state.csv").read_text()


def test_a_bag_of_sqlite3_is_refused_with_the_command_that_converts_it(hsv: Hsv, tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "old_0.db3").write_bytes(b"SQLite format 3\0")
    for path in ("old", "old/old_0.db3"):
        ran = hsv("info", path)
        assert ran.code == 2
        assert f"{path}: recorded with sqlite3, expected MCAP: ros2 bag convert -i {path} " in ran.error


@pytest.mark.parametrize(
    ("kind", "field", "commands"),
    [
        ("ControlInput", "fuel_equivalence_ratio", ["plot", "report"]),
        ("VehicleState", "altitude", ["info", "plot"]),
        ("VehicleState", "step", ["replay", "replay --rerun"]),
        ("NominalState", "gain_index", ["report"]),
        ("ControlInput", "saturated", ["info"]),
        ("TubeStatus", "tau", ["replay"]),
        ("Actuator", "active", ["plot"]),
        ("Actuator", "step", ["replay"]),
    ],
)
def test_a_field_that_a_definition_lacks_is_named(
    hsv: Hsv, bag: Path, tmp_path: Path, kind: str, field: str, commands: list[str]
) -> None:
    made = changed_bag(bag, tmp_path / "made", _renamed(f"hsv_msgs/msg/{kind}", field))
    for command in commands:
        ran = hsv(*command.split(), str(made))
        assert ran.code == 2 and "recorded with another definition" in ran.err and ran.err.count("\n") == 1
        assert f"expected a field {field}" in ran.err and str(made) in ran.err


def test_messages_whose_definition_is_damaged_are_recovered(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    made = changed_bag(bag, tmp_path / "made", _with(FORCES, definition="no message\0"))
    file = next(made.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-1000])
    messages = sum(topic.count for topic in Bag(made).topics.values())
    ran = hsv("recover", str(made), "--out", "new", "--json")
    assert ran.code == 0 and ran.json["messages"] == messages and ran.json["lost_s"] is None
    assert ran.json["loss"][-1].startswith("definition of hsv_msgs/msg/VehicleForces: ")
    said = hsv("recover", str(made), "--out", "again").out
    assert "an unknown time lost: definition of hsv_msgs/msg/VehicleForces: " in said
    assert hsv("recover", "new").code == 2, "nothing is left to be recovered, and it is no whole bag"


def test_an_attachment_that_is_no_text(hsv: Hsv, bag: Path, tmp_path: Path) -> None:
    made = changed_bag(bag, tmp_path / "made", attachments={"scenario.yaml": b"duration: \xff"})
    ran = hsv("replay", str(made))
    assert ran.code == 2 and "attachment scenario.yaml: 'utf-8' codec" in ran.error

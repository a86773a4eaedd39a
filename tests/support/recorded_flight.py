"""A bag as `hsv run` leaves it, flown in this process: the graph's own processes, messages and parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from hsv.bags.description import STATE, TOPICS, resolved
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.engine import fly
from hsv.bags.topic import Qos, Topic
from hsv.bags.typestore import blank
from hsv.bags.writer import BagWriter
from hsv.control.design import find_design, find_file
from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import parse_scenario, scenario_text

MESSAGES = Path(__file__).parents[2] / "ros_ws" / "src" / "hsv_msgs" / "msg"
LOG, DIAGNOSTICS = "rcl_interfaces/msg/Log", "diagnostic_msgs/msg/DiagnosticArray"


def message_types() -> Typestore:
    """Return the message types of ROS 2 and ours."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types: dict[str, Any] = {}
    for path in sorted(MESSAGES.glob("*.msg")):
        types |= get_types_from_msg(path.read_text(), f"hsv_msgs/msg/{path.stem}")
    store.register(types)
    return store


def record_flight(
    directory: Path,
    scenario: str = "case1",
    duration: float = 20.0,
    fault: float = 8.0,
    log: tuple[tuple[float, int, str], ...] = (),
    **changes: Any,
) -> Bag:
    """Fly a shipped scenario, shortened, and record it to a new bag.

    `log` holds time, level and text of lines that tube_mpc says in flight, on /rosout and /diagnostics. Changed
    parameters of the design are written with __ for the dot.
    """
    text = scenario_text(scenario).replace('"200 s"', f'"{duration} s"').replace('"100 s"', f'"{fault} s"')
    flown = parse_scenario(text, scenario)
    changed = {name.replace("__", "."): value for name, value in changes.items()}
    values = flight_parameters(flown) | changed
    types = message_types()
    kinds = {resolved(role): kind for role, kind in TOPICS.items()} | {"/rosout": LOG, "/diagnostics": DIAGNOSTICS}
    topics = [
        Topic(name, kind, types.generate_msgdef(kind, ros_version=2)[0], types.hash_rihs01(kind), Qos())
        for name, kind in kinds.items()
    ]
    custom = {"run_id": "1f" * 16, "scenario": flown.name, "title": flown.title, "commit": "ab" * 20}
    writer = BagWriter(directory, topics, custom | {"design": flown.design, "seed": "none"})
    design = {name: value for name, value in values.items() if name not in flown.parameters()}
    writer.attach("scenario.toml", "text/plain", text.encode())
    writer.attach("scenario.yaml", "text/plain", ParameterSections(flown.parameters()).to_yaml().encode())
    writer.attach("design.yaml", "text/plain", ParameterSections(design).to_yaml().encode())
    certificate = find_file(flown.design, ".certificate.json")
    assert certificate.parent == find_design(flown.design).parent
    writer.attach("certificate.json", "application/json", certificate.read_bytes())
    for time, level, said in log:
        _say(writer, types, round(time * 1e9), level, said)
    _fly(writer, types, values)
    writer.close()
    return Bag(directory)


def _fly(writer: BagWriter, types: Typestore, values: dict[str, Any]) -> None:
    tracks = fly(types, "tube_mpc", ParameterSections(values), lambda *_: None)
    for row, time in enumerate(tracks[STATE].times):
        for topic in TOPICS:
            writer.write(resolved(topic), time, tracks[topic].data[row])


def _say(writer: BagWriter, types: Typestore, time: int, level: int, text: str) -> None:
    line = blank(types, LOG)
    line.level, line.name, line.msg = level, "tube_mpc", text
    writer.write("/rosout", time, bytes(types.serialize_cdr(line, LOG)))
    status = blank(types, "diagnostic_msgs/msg/DiagnosticStatus")
    status.level, status.name, status.message = level // 10 - 2, "tube_mpc", text
    array = blank(types, DIAGNOSTICS)
    array.status = [status]
    writer.write("/diagnostics", time, bytes(types.serialize_cdr(array, DIAGNOSTICS)))

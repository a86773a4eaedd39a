"""A bag as `hsv run` leaves it, but flown in this process, with the graph's processes, messages and parameters."""

from pathlib import Path

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hsv.bags.definitions import blank, definition, type_hash
from hsv.bags.description import STATE, TOPICS, resolved
from hsv.bags.metadata import Topic, usual_qos
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.reader import Bag
from hsv.bags.replay.engine import fly
from hsv.bags.writer import BagWriter
from hsv.control.design_file import find_file
from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import parse_scenario, scenario_text
from hsv.model.faults.injector import FaultInjector

MESSAGES = Path(__file__).parents[2] / "ros_ws" / "src" / "hsv_msgs" / "msg"
LOG, DIAGNOSTICS = "rcl_interfaces/msg/Log", "diagnostic_msgs/msg/DiagnosticArray"
NOTHING = {}


def message_types():
    """Return the message types of ROS 2 and of this project."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for path in sorted(MESSAGES.glob("*.msg")):
        types |= get_types_from_msg(path.read_text(), f"hsv_msgs/msg/{path.stem}")
    store.register(types)
    return store


def record_flight(directory, scenario="case1", duration=20.0, fault=8.0, log=(), in_flight=NOTHING, **changes):
    """Fly a shortened shipped scenario and record it to a new bag.

    Args:
        directory: The bag.
        scenario: A scenario of 200 s whose fault begins at 100 s.
        duration: Its new duration (s).
        fault: The new start of its fault (s).
        log: Time, level and text of lines that tube_mpc logs, on /rosout and /diagnostics.
        in_flight: Changes of the fault injector in flight, by the step before which they act.
        changes: Changed parameters of the design, written with __ for the dot.
    """
    text = scenario_text(scenario).replace('"200 s"', f'"{duration} s"').replace('"100 s"', f'"{fault} s"')
    flown = parse_scenario(text, scenario)
    changed = {name.replace("__", "."): value for name, value in changes.items()}
    values = flight_parameters(flown) | changed
    types = message_types()
    kinds = {resolved(role): kind for role, kind in TOPICS.items()} | {"/rosout": LOG, "/diagnostics": DIAGNOSTICS}
    topics = [Topic(name, kind, definition(kind), type_hash(kind), usual_qos()) for name, kind in kinds.items()]
    custom = {"run_id": "1f" * 16, "scenario": flown.name, "title": flown.title, "commit": "ab" * 20}
    writer = BagWriter(directory, topics, custom | {"design": flown.design, "seed": "none"})
    design = {name: value for name, value in values.items() if name not in flown.parameters()}
    writer.attach("scenario.toml", "text/plain", text.encode())
    writer.attach("scenario.yaml", "text/plain", ParameterSections(flown.parameters()).to_yaml().encode())
    writer.attach("design.yaml", "text/plain", ParameterSections(design).to_yaml().encode())
    writer.attach("certificate.json", "application/json", find_file(flown.design, ".certificate.json").read_bytes())
    for time, level, said in log:
        _say(writer, types, round(time * 1e9), level, said)
    tracks = fly(types, "tube_mpc", ParameterSections(values | _injected(values, in_flight)), lambda *_: None)
    for row, stamp in enumerate(tracks[STATE].times):
        for topic in TOPICS:
            writer.write(resolved(topic), stamp, tracks[topic].data[row])
    writer.close()
    return Bag(directory)


def _injected(values, in_flight):
    """Return the fault parameters of a flight after changes of the fault injector in flight."""
    injector = FaultInjector.from_parameters(values)
    for step in range(max(in_flight, default=0) + 1):
        if step in in_flight:
            in_flight[step](injector)
        injector.step(step, np.zeros(2))
    return injector.parameters()


def _say(writer, types, time, level, text):
    line = blank(types, LOG)
    line.level, line.name, line.msg = level, "tube_mpc", text
    writer.write("/rosout", time, bytes(types.serialize_cdr(line, LOG)))
    status = blank(types, "diagnostic_msgs/msg/DiagnosticStatus")
    status.level, status.name, status.message = level // 10 - 2, "tube_mpc", text
    array = blank(types, DIAGNOSTICS)
    array.status = [status]
    writer.write("/diagnostics", time, bytes(types.serialize_cdr(array, DIAGNOSTICS)))

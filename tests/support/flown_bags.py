"""Bags of flights flown in this process, for tests that need no DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from hsv.bags.columns import Track
from hsv.bags.definitions import definition, type_hash
from hsv.bags.description import TOPICS, resolved
from hsv.bags.parameter_sections import ParameterSections
from hsv.bags.replay.attached import controller_of
from hsv.bags.replay.engine import fly
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import BagWriter
from hsv.flight.assembly import flight_parameters
from hsv.flight.scenario import load_scenario
from hsv.model.faults.injector import FaultInjector

InFlight = Mapping[int, Callable[[FaultInjector], object]]
"""By step: what is done to the fault injector before it."""

NOTHING: InFlight = {}


def parameters(duration: float, fault: float, scenario: str = "case1") -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the parameters of the design and of a shortened scenario."""
    loaded = load_scenario(scenario)
    own = loaded.parameters() | {"duration": duration, "fault.starts": [fault]}
    return {k: v for k, v in flight_parameters(loaded).items() if k not in own}, own


def types() -> Typestore:
    """Return today's definitions of all step topics."""
    store = get_typestore(Stores.EMPTY)
    for kind in dict.fromkeys(TOPICS.values()):
        store.register(get_types_from_msg(definition(kind), kind))
    return store


def as_flown(values: Mapping[str, Any], in_flight: InFlight) -> dict[str, Any]:
    """Return the fault parameters of a flight in which something was done to the fault injector."""
    import numpy as np

    injector = FaultInjector.from_parameters(values)
    for step in range(max(in_flight, default=0) + 1):
        if step in in_flight:
            in_flight[step](injector)
        injector.step(step, np.zeros(2))
    return injector.parameters()


def flown_bag(path: Path, duration: float = 12.0, fault: float = 6.0, in_flight: InFlight = NOTHING) -> Path:
    """Fly a shortened Case 1 and record it as the recorder does, parameters attached."""
    design, scenario = parameters(duration, fault)
    values = ParameterSections(design | scenario)
    values = values.updated(as_flown(values.shared, in_flight))
    tracks = fly(types(), controller_of(values), values, lambda *_: None)
    return write_bag(path, tracks, design, scenario)


def write_bag(path: Path, tracks: Mapping[str, Track], design: Mapping[str, Any], scenario: Mapping[str, Any]) -> Path:
    """Write tracks as a bag with attached parameters."""
    kinds = {topic: kind for topic, kind in TOPICS.items() if topic in tracks}
    topics = [Topic(resolved(t), kind, definition(kind), type_hash(kind), Qos()) for t, kind in kinds.items()]
    writer = BagWriter(path, topics, {"scenario": "short", "commit": "0" * 40})
    for name, values in (("design.yaml", design), ("scenario.yaml", scenario)):
        plain = {key: value.tolist() if hasattr(value, "tolist") else value for key, value in values.items()}
        writer.attach(name, "application/yaml", ParameterSections(plain).to_yaml().encode())
    longest = max(len(track.data) for track in tracks.values())
    for row in range(longest):
        for topic in kinds:
            track = tracks[topic]
            if row < len(track.data):
                writer.write(resolved(topic), track.times[row], track.data[row])
    writer.close()
    return path

"""Copies of bags for viewers: an MCAP file with the messages of a bag, the scene of the vehicle and an overview.

The overview has data from several topics: nominal state, bounds of the tube, active faults. Viewers plot fields but do
not add them; the nominal state is the sum of two fields, a bound of the tube of four.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from hsv.bags.columns import Columns
from hsv.bags.description import ACTUATOR, NOMINAL, STATE, TUBE_STATUS
from hsv.bags.equipment import effectors, equipment_topics
from hsv.bags.flight import input_columns, state_columns
from hsv.bags.metadata import CUSTOM_DATA
from hsv.bags.reader import Bag
from hsv.bags.steps import joined
from hsv.bags.topic import Qos, Topic
from hsv.bags.writer import Schemas, register
from hsv.base.errors import RecordingError
from hsv.model.airframe.pose import Sample
from hsv.model.airframe.scene import RATE, SCENE_TOPIC, TRANSFORMS_TOPIC, frame_transforms, scene
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES

OVERVIEW_TOPIC = "/hsv/overview"
OVERVIEW_TYPE = "hsv.Overview"

STATES = STATE_NAMES[:N_RIGID]
"""Fields of each part, SI."""

PARTS = ("nominal", "lower", "upper")
"""Parts of the message; the bounds exist only for a flight with a tube."""

FAULTS = "faults"
NO_FAULT = "none"

OVERVIEW_SCHEMA: dict[str, Any] = {
    "title": OVERVIEW_TYPE,
    "type": "object",
    "properties": {
        part: {"type": "object", "properties": {name: {"type": "number"} for name in STATES}} for part in PARTS
    }
    | {FAULTS: {"type": "string"}},
}
"""JSON schema of the message."""


def overview_message(
    nominal: np.ndarray, centre: Sequence[float], half_width: Sequence[float], faults: Sequence[tuple[str, str]]
) -> bytes:
    """Return the message of a step as JSON.

    Args:
        nominal: Nominal state x_r + x_n, the rigid states first, SI.
        centre: Centre of the invariant set of errors, the rigid states first; empty if the design has none.
        half_width: Half-widths of the set, in the order of ``centre``.
        faults: Channel and type of each active fault.
    """
    nominal = np.asarray(nominal[:N_RIGID], float)
    parts = {"nominal": nominal}
    if len(half_width):
        middle, half = (np.asarray(values[:N_RIGID], float) for values in (centre, half_width))
        parts |= {"lower": nominal + middle - half, "upper": nominal + middle + half}
    message: dict[str, Any] = {
        # JSON has neither NaN nor infinities.
        part: {name: value for name, value in zip(STATES, values.tolist(), strict=True) if np.isfinite(value)}
        for part, values in parts.items()
    }
    message[FAULTS] = "; ".join(f"{channel}: {kind}" for channel, kind in faults) or NO_FAULT
    return json.dumps(message, separators=(",", ":")).encode()


Message = tuple[int, str, bytes]
"""Time (ns), topic and data."""


def scene_path(bag: Bag) -> Path:
    """Return the default path of the viewer file of ``bag``, in a folder inside the bag directory."""
    return bag.folder / "scene" / f"{bag.path.stem}_scene.mcap"


def scene_of(bag: Bag) -> Path:
    """Return the viewer file of ``bag``; write it if it is missing or older than the bag.

    Raises:
        RecordingError: See :func:`write_scene`.
    """
    target = scene_path(bag)
    if not target.is_file() or target.stat().st_mtime < bag.path.stat().st_mtime:
        target.unlink(missing_ok=True)
        write_scene(bag, target)
    return target


def write_scene(bag: Bag, target: Path, exaggeration: float | None = None) -> None:
    """Write ``target`` with the messages and attachments of ``bag``, and the vehicle as a Foxglove scene with frames.

    Args:
        bag: A flight.
        target: New MCAP file.
        exaggeration: Factor on the bending; default: the value of the airframe.

    Raises:
        RecordingError: The bag holds no flight, or the file exists or cannot be written.
    """
    pictures = _pictures(bag, exaggeration)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("xb") as stream:
            writer = Writer(stream, compression=CompressionType.ZSTD)
            writer.start(profile="ros2")
            channels = _channels(writer, bag)
            recorded = [[(time, topic, data) for time, data in bag.messages(topic)] for topic in bag.topics]
            for time, topic, data in merge(pictures, *recorded, key=lambda message: message[0]):
                writer.add_message(channels[topic], time, data, time)
            for name, data in bag.attachments.items():
                writer.add_attachment(0, 0, name, bag.media_types[name], data)
            if bag.custom_data:
                writer.add_metadata(CUSTOM_DATA, bag.custom_data)
            writer.finish()
    except FileExistsError:
        raise RecordingError(f"out = {str(target)!r}: exists already, expected a new file") from None
    except OSError as error:
        raise RecordingError(f"{target}: cannot be written: {error.strerror}, expected an MCAP file to write") from None


def _channels(writer: Writer, bag: Bag) -> dict[str, int]:
    """Register every topic; return the channel numbers by topic."""
    topics = list(bag.topics.values())
    for name, message in ((SCENE_TOPIC, scene(0)), (TRANSFORMS_TOPIC, frame_transforms(Sample(*[0.0] * 6), 0))):
        schema = message.get_schema()
        definition = schema.data.decode(errors="surrogateescape")
        topics.append(Topic(name, schema.name, definition, "", Qos(), 0, schema.encoding, "protobuf"))
    definition = json.dumps(OVERVIEW_SCHEMA)
    topics.append(Topic(OVERVIEW_TOPIC, OVERVIEW_TYPE, definition, "", Qos(), 0, "jsonschema", "json"))
    schemas: Schemas = {}
    return {topic.name: register(writer, topic, schemas) for topic in topics}


def _pictures(bag: Bag, exaggeration: float | None) -> list[Message]:
    """Return the added messages, scene, frames and overview, in order of time."""
    topics = dict.fromkeys((STATE, ACTUATOR, NOMINAL, *equipment_topics(bag)))
    if TUBE_STATUS in bag.roles:
        topics[TUBE_STATUS] = None
    columns = joined(bag, list(topics))
    stamps = columns[STATE]["header.stamp"].tolist()
    inputs = dict(zip(INPUT_NAMES, input_columns(columns[ACTUATOR]).T, strict=True))
    for name, positions in effectors(columns).items():
        inputs[name] = np.where(np.isfinite(positions), positions, inputs[name])
    states = dict(zip(STATE_NAMES, state_columns(columns[STATE]).T, strict=True))
    drawn = np.stack([(states | inputs)[name] for name in Sample._fields], axis=1)
    nominal = state_columns(columns[NOMINAL], "reference.") + state_columns(columns[NOMINAL], "deviation.")
    tube = columns.get(TUBE_STATUS, Columns())
    centre, half = (tube.get(name, [()] * len(stamps)) for name in ("tube_centre", "tube_half_width"))

    active = columns[ACTUATOR]["active"]

    found: list[Message] = [(stamps[0], SCENE_TOPIC, scene(stamps[0], exaggeration).encode())]
    due = stamps[0]
    for row, stamp in enumerate(stamps):
        faults = [(fault["channel"], fault["type"]) for fault in active[row]]
        found.append((stamp, OVERVIEW_TOPIC, overview_message(nominal[row], centre[row], half[row], faults)))
        if stamp >= due and np.isfinite(drawn[row]).all():
            message = frame_transforms(Sample(*drawn[row].tolist()), stamp, exaggeration)
            found.append((stamp, TRANSFORMS_TOPIC, message.encode()))
            due = stamp + round(1e9 / RATE)
    return found

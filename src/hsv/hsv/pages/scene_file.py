"""Copies of bags for viewers: an MCAP file with the messages of a bag and the scene of the vehicle."""

from __future__ import annotations

from heapq import merge
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from hsv.bags.description import ACTUATOR, STATE
from hsv.bags.flight import effectors, equipment_topics, input_columns, state_columns
from hsv.bags.metadata import CUSTOM_DATA, Topic, usual_qos
from hsv.bags.reader import Bag
from hsv.bags.steps import joined
from hsv.bags.writer import Schemas, register
from hsv.base.errors import RecordingError
from hsv.model.signals import INPUT_NAMES, N_RIGID, STATE_NAMES
from hsv.pages.airframe.pose import Sample
from hsv.pages.airframe.scene import RATE, SCENE_TOPIC, TRANSFORMS_TOPIC, frame_transforms, scene
from hsv.pages.layouts import foxglove_layout

Message = tuple[int, str, bytes]
"""Time (ns), topic and data."""


def scene_path(bag: Bag) -> Path:
    """Return the default path of the viewer file of ``bag``, in a folder inside the bag directory."""
    return bag.folder / "scene" / f"{bag.path.stem}_scene.mcap"


def write_scene(bag: Bag, target: Path, exaggeration: float | None = None) -> Path:
    """Write ``target`` with the messages and attachments of ``bag``, and the vehicle as a Foxglove scene with frames.

    Write next to it, and return, the layout to import, ``layout_foxglove.json``. ``exaggeration`` is the factor on the
    bending; default: the value of the airframe. A RecordingError says that the bag holds no flight, or that the file
    exists or cannot be written.
    """
    pictures, layout = _pictures(bag, exaggeration), target.with_name("layout_foxglove.json")
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
        layout.write_text(foxglove_layout(bag.name_of), encoding="utf-8")
    except FileExistsError:
        raise RecordingError(f"out = {str(target)!r}: exists already, expected a new file") from None
    except OSError as error:
        raise RecordingError(f"{target}: cannot be written: {error.strerror}, expected an MCAP file to write") from None
    return layout


def _channels(writer: Writer, bag: Bag) -> dict[str, int]:
    """Register the topics of ``bag`` and of the scene with ``writer``; return the channel ids by topic."""
    topics = list(bag.topics.values())
    for name, message in ((SCENE_TOPIC, scene(0)), (TRANSFORMS_TOPIC, frame_transforms(Sample(*[0.0] * 6), 0))):
        schema = message.get_schema()
        definition = schema.data.decode(errors="surrogateescape")
        topics.append(Topic(name, schema.name, definition, "", usual_qos(), 0, schema.encoding, "protobuf"))
    schemas: Schemas = {}
    return {topic.name: register(writer, topic, schemas) for topic in topics}


def _pictures(bag: Bag, exaggeration: float | None) -> list[Message]:
    """Return the messages that a viewer file adds, sorted by time: the scene, then the frames of the vehicle."""
    columns = joined(bag, list(dict.fromkeys((STATE, ACTUATOR, *equipment_topics(bag)))))
    stamps = columns[STATE]["header.stamp"].tolist()
    inputs = dict(zip(INPUT_NAMES, input_columns(columns[ACTUATOR]).T, strict=True))
    for name, positions in effectors(columns).items():
        inputs[name] = np.where(np.isfinite(positions), positions, inputs[name])
    states = dict(zip(STATE_NAMES, state_columns(columns[STATE]).T, strict=True))
    plain = not any(states[name].any() for name in STATE_NAMES[N_RIGID:])  # a rigid vehicle
    drawn = np.stack([(states | inputs)[name] for name in Sample._fields], axis=1)
    found: list[Message] = [(stamps[0], SCENE_TOPIC, scene(stamps[0], exaggeration, plain).encode())]
    due = stamps[0]
    for row, stamp in enumerate(stamps):
        if stamp >= due and np.isfinite(drawn[row]).all():
            message = frame_transforms(Sample(*drawn[row].tolist()), stamp, exaggeration)
            found.append((stamp, TRANSFORMS_TOPIC, message.encode()))
            due = stamp + round(1e9 / RATE)
    return found

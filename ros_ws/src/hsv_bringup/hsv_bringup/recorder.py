"""The recorder node: writes every message of a run to an MCAP bag and confirms to the plant what is written."""

from __future__ import annotations

import datetime
import mimetypes
import struct
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from hsv_msgs.msg import RecorderProgress, Run

from hsv.errors import ParameterError
from hsv.graph.description import OTHER_TOPICS, TOPICS
from hsv.graph.part_parameters import RECORDER_PARAMETERS
from hsv.recording.definitions import definition, type_hash
from hsv.recording.topic import Qos, Topic
from hsv.recording.writer import BagWriter
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node
from hsv_node.messages import message_class
from hsv_node.parameters import declare
from hsv_node.qos import LATCHED, STEP

CONFIRMATION_INTERVAL = 50
"""Steps between confirmations: a confirmation of every step would halve the speed of the loop."""

_STAMP = struct.Struct("<iI")
_STATUS = 100
"""Where VehicleState carries its status; what follows pads the message to a multiple of four bytes."""
_ORDER = {topic: index for index, topic in enumerate(TOPICS)}


class RecorderNode(PeerNode):
    """Writes the messages of a step in a fixed order once all are there, so that equal runs give equal bags."""

    def __init__(self) -> None:
        super().__init__("recorder")
        values = declare(self, RECORDER_PARAMETERS)
        utc = datetime.datetime.now(datetime.UTC).strftime("%Y%m%dT%H%M%SZ")
        directory = Path(values["bag.directory"] or f"bags/run_{utc}")
        self._last_step = 0
        self._now = 0
        self._complete = -1
        self._nanoseconds_per_step = 0
        self._pending: dict[int, dict[str, bytes]] = {}
        attachments = [Path(name) for name in values["bag.attachments"] if name]
        for path in attachments:
            if not path.is_file():
                raise ParameterError(f"parameter bag.attachments = {str(path)!r}: expected an existing file")
        custom_data = dict(pair.split("=", 1) for pair in values["bag.custom_data"] if "=" in pair)
        self.bag = BagWriter(directory, custom_data=custom_data)
        for path in attachments:
            media_type = mimetypes.guess_type(path.name)[0] or "text/plain"
            self.bag.attach(path.name, media_type, path.read_bytes())
        for topic, kind in (TOPICS | OTHER_TOPICS).items():
            latched = topic in ("/hsv/run", "/hsv/ready")
            qos = Qos(depth=LATCHED.depth, durability="transient_local") if latched else Qos(depth=STEP.depth)
            self.bag.add_topic(Topic(topic, kind, definition(kind), type_hash(kind), qos))
        for topic in TOPICS:
            self.create_step_subscription(topic, partial(self._on_step_message, topic), raw=True)
        for topic, kind in OTHER_TOPICS.items():
            profile = LATCHED if topic.startswith("/hsv/") else STEP
            callback: Callable[[bytes], None] = partial(self._on_other_message, topic)
            self.create_subscription(message_class(kind), topic, callback, profile, raw=True)
        self._progress_message = RecorderProgress()
        self._progress = self.create_publisher(RecorderProgress, "/hsv/recorder_progress", STEP)
        self.get_logger().info(f"recording to {directory}")

    def start_run(self, run: Run) -> None:
        """Note how many steps will come; a second run would need a second bag."""
        if self._complete >= 0:
            self.get_logger().fatal(
                "a new run was announced: expected a recorder of its own for every run, "
                "and a ROS_DOMAIN_ID of its own for each that flies at the same time"
            )
            self.finish(1)
        self._last_step = run.last_step
        self._nanoseconds_per_step = round(run.period * 1e9)

    def _on_step_message(self, topic: str, data: bytes) -> None:
        # Every step topic begins with the simulated time, right behind the four bytes of the CDR header.
        seconds, nanoseconds = _STAMP.unpack_from(data, 4)
        stamp = seconds * 1_000_000_000 + nanoseconds
        step = self._pending.setdefault(stamp, {})
        step[topic] = data
        if len(step) == len(_ORDER):
            self._write_step(stamp)

    def _write_step(self, stamp: int) -> None:
        messages = self._pending.pop(stamp)
        for topic in _ORDER:
            self.bag.write(topic, stamp, messages[topic])
        self._now = stamp
        self._complete = round(stamp / self._nanoseconds_per_step)
        final = self._complete >= self._last_step or self._is_last(messages["/hsv/state"])
        if self._complete % CONFIRMATION_INTERVAL == 0 or final:
            # What is confirmed is on its way to the disk, whatever happens to this process.
            self.bag.flush()
            self._progress_message.step = self._complete
            self._progress.publish(self._progress_message)

    @staticmethod
    def _is_last(state: bytes) -> bool:
        return state[_STATUS] != 0

    def _on_other_message(self, topic: str, data: bytes) -> None:
        self.bag.write(topic, self._now, data)

    def close(self) -> None:
        """Write what has come of an unfinished step, and finish the bag."""
        for stamp in sorted(self._pending):
            for topic in sorted(self._pending[stamp], key=_ORDER.__getitem__):
                self.bag.write(topic, stamp, self._pending[stamp][topic])
        self.bag.close()


def main(args: Sequence[str] | None = None) -> int:
    """Run the recorder node."""
    return run_node(RecorderNode, "recorder", args)

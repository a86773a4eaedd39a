"""Cost of watching a flight: processor time of a graph in real time, with a live view and without."""

from __future__ import annotations

import json
import re
import resource
import tempfile
import threading
from contextlib import suppress
from pathlib import Path

from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from hsv.bags.parameter_sections import ParameterSections
from hsv.bench.figure import Figure
from hsv.graph.launcher import Launcher, parameter_arguments
from hsv.graph.preparation import RunOptions, prepare

_ADDRESS = re.compile(r"live data: (ws://\S+)")


def watched(repeats: int, duration: float = 200.0) -> list[Figure]:
    """Return the processor time of Case 1 at real-time pace, with a client that takes every topic and without."""
    ours, theirs = [], []
    for _ in range(repeats):
        theirs.append(processor_seconds(duration, live=False))
        ours.append(processor_seconds(duration, live=True))
    what = f"processor time of Case 1, {duration:g} s at real-time pace, live view and a client of all topics"
    return [Figure("live", what, "the same without live view", "s", tuple(ours), tuple(theirs), "most", 1.15)]


def processor_seconds(duration: float, *, live: bool) -> float:
    """Return the processor time (s) of all processes of a flight, their start included, and not that of the client.

    Raises:
        RunError: A process ended before its time, or the workspace is not built.
    """
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        bag = Path(folder, "bag")
        prepared = prepare("case1", RunOptions(real_time_factor=1.0, live_port=0 if live else None), bag=bag)
        shortened = Path(folder, "duration.yaml")
        shortened.write_text(ParameterSections({"duration": float(duration)}).to_yaml(), encoding="utf-8")
        arguments = parameter_arguments([*prepared.parameter_files, shortened])

        def on_line(node: str, text: str) -> None:
            if found := _ADDRESS.search(text):
                threading.Thread(target=_read_all, args=(found[1],), daemon=True).start()

        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with Launcher(prepared.nodes, arguments, lambda step: None, on_line) as launcher:
            launcher.wait()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _read_all(address: str) -> None:
    """Subscribe every topic, and take what comes until the server has left."""
    with (
        suppress(WebSocketException, OSError),
        connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")]) as socket,
    ):
        for message in socket:
            if isinstance(message, str) and (said := json.loads(message))["op"] == "advertise":
                channels = [{"id": channel["id"], "channelId": channel["id"]} for channel in said["channels"]]
                socket.send(json.dumps({"op": "subscribe", "subscriptions": channels}))

"""Data of the live page: latest messages, decimated history of the plotted curves, faults, diagnostics and events."""

from __future__ import annotations

import threading
from collections import defaultdict, deque
from collections.abc import Callable, Mapping
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from hsv.bags.description import ACTUATOR, NOMINAL, STATE, TUBE_STATUS
from hsv.bags.messages import fault_in
from hsv.model.plant import FlightStatus
from hsv.pages.panels import LIVE_CURVES

MAX_ROWS = 20_000
"""Maximum number of rows of the history; when it is reached, every second row is dropped."""

_KEPT = 16
"""Number of messages kept per topic, enough to find the newest complete step."""

_EVENTS = 200
"""Maximum number of events, and of shaded intervals with a fault."""


class Hub:
    """Collection of the data of the page, written by the live node and read by the thread of the page server."""

    def __init__(self, decode: Callable[[str, bytes], Any], about: Mapping[str, str]) -> None:
        """Start without data; ``decode`` deserializes a message of a topic, ``about`` has ``title`` and ``bag``."""
        self._topics = tuple(dict.fromkeys(curve.topic for _, curve in LIVE_CURVES))
        self._steady = frozenset(self._topics) - {TUBE_STATUS}
        """Topics of every step; a custom controller does not publish the tube status."""
        self._decode = decode
        self._about = dict(about)
        self._lock = threading.Lock()
        self._generation = 0
        self._status: dict[str, Any] = {"run": None, "settings": {}, "limits": {}}
        self.version = 0
        """Number of changes of :meth:`status` so far."""
        self._reset()

    def _reset(self) -> None:
        self._generation += 1
        self._latest: dict[str, deque[tuple[int, bytes]]] = defaultdict(lambda: deque(maxlen=_KEPT))
        self._rows = np.empty((MAX_ROWS, 1 + len(LIVE_CURVES)), np.float32)
        self._count = 0
        self._sampled = -1
        self._period = 0.0
        self._status |= {"faults": [], "shades": [], "diagnostics": {}, "events": [], "ending": None, "tau": None}
        self._status |= {"tube_status": None, "nominal_status": 0}

    def start_run(self, run_id: str, period: float, last_step: int) -> None:
        """Start a new run and discard the data of the previous one."""
        with self._lock:
            self._reset()
            self._period = period
            self._status |= {"run": {"id": run_id, "period": period, "last_step": last_step}}
            self.version += 1

    def offer(self, topic: str, time: int, data: bytes) -> None:
        """Store a serialized message of a step topic with its simulated ``time`` (ns)."""
        self._latest[topic].append((time, data))

    def update(self, **values: Any) -> None:
        """Change entries of :meth:`status`: ``settings``, ``limits`` or the ``ending`` of the run."""
        with self._lock:
            self._update(values)

    def diagnose(self, node: str, level: int, words: str, values: Mapping[str, str]) -> None:
        """Store the diagnostics of a node."""
        with self._lock:
            entry = {"level": level, "words": words, "values": dict(values)}
            self._update({"diagnostics": self._status["diagnostics"] | {node: entry}})

    def note(self, words: str, *, step: int | None = None, warning: bool = False) -> None:
        """Add an event at ``step``, or at the current step if None."""
        with self._lock:
            self._note(words, round(self.time * 1e-9 / self._period) if step is None else step, warning)

    def sample(self) -> None:
        """Add the newest complete step to history and status, unless it has been added already."""
        kept = {topic: self._latest[topic] for topic in self._topics if self._latest[topic]}
        if not kept.keys() >= self._steady:
            return
        # The messages of a step arrive one by one: some topics may already have a message of the next step.
        time = min(messages[-1][0] for messages in kept.values())
        step = {topic: next((data for at, data in messages if at == time), b"") for topic, messages in kept.items()}
        if time <= self._sampled or b"" in step.values():
            return
        self._sampled = time
        messages = {topic: self._decode(topic, data) for topic, data in step.items()}
        values = [time * 1e-9]
        for _, curve in LIVE_CURVES:
            message = messages.get(curve.topic)
            values.append(np.nan if message is None else curve.value(partial(_field, message)))
        with self._lock:
            if self._count == len(self._rows):
                thinned = self._rows[::2].copy()
                self._count = len(thinned)
                self._rows[: self._count] = thinned
                self._generation += 1
            self._rows[self._count] = values
            self._count += 1
            self._update(self._status_of(messages))

    def history(self, generation: int, first: int) -> tuple[int, int, np.ndarray]:
        """Return the generation of the history, the index of the first returned row, and the returned rows.

        The generation changes when the history restarts or is decimated. The rows are those from ``first`` on if
        ``generation`` is still the current one, otherwise all. They are a float32 array, shape (n, 1 + curves): the
        time (s) and the values (SI) of the curves in :data:`hsv.pages.panels.LIVE_CURVES`.
        """
        with self._lock:
            first = first if generation == self._generation else 0
            return self._generation, first, self._rows[first : self._count].astype("<f4")

    def status(self) -> dict[str, Any]:
        """Return all data except the rows, as plain data for JSON."""
        with self._lock:
            return {**self._about, **self._status}

    @property
    def time(self) -> int:
        """Simulated time (ns) of the newest state; 0 without one."""
        return self._latest[STATE][-1][0] if self._latest[STATE] else 0

    def end(self, status: int, step: int) -> None:
        """Record the end of the run at ``step``; a run whose last ``status`` is still ``RUNNING`` was broken off."""
        how = {FlightStatus.FINISHED: "finished", FlightStatus.DIVERGED: "diverged"}
        self.update(ending={"how": how.get(FlightStatus(status), "broken off"), "time": round(step * self._period, 9)})

    def _status_of(self, messages: Mapping[str, Any]) -> dict[str, Any]:
        """Return the status entries from the messages of a step, and add events for faults that begin or end."""
        actuator = messages[ACTUATOR]
        faults = [
            {"words": str(fault_in(fault)), "channel": fault.channel, "type": fault.type, "since": int(since)}
            for fault, since in zip(actuator.active, actuator.since, strict=True)
        ]
        # Every start and end of a fault, scheduled or injected, is an event; a replacement is one event.
        before, step = self._status["faults"], int(messages[STATE].step)
        begun = {(fault["channel"], fault["type"]): fault for fault in faults if fault not in before}
        ended = {(fault["channel"], fault["type"]): fault for fault in before if fault not in faults}
        for kind, fault in begun.items():
            words = f"replaces {ended[kind]['words']}" if kind in ended else "begins"
            self._note(f"{fault['words']} {words}", fault["since"], True)
        for kind, fault in ended.items():
            if kind not in begun:
                self._note(f"{fault['words']} has ended", step, False)
        shades = [dict(shade) for shade in self._status["shades"]]
        for shade in shades:
            kind = shade["channel"], shade["type"]
            if shade["to"] is None and kind in ended:
                shade["to"] = begun[kind]["since"] if kind in begun else step
        shades += (
            {"channel": channel, "type": type, "from": begun[channel, type]["since"], "to": None}
            for channel, type in begun
        )
        status = {"faults": faults, "shades": shades[-_EVENTS:], "nominal_status": messages[NOMINAL].status}
        if TUBE_STATUS in messages:
            tube = messages[TUBE_STATUS]
            status |= {"tau": [round(float(value), 12) for value in tube.tau], "tube_status": tube.status}
        return status

    def _note(self, words: str, step: int, warning: bool) -> None:
        event = {"time": round(step * self._period, 9), "step": step, "words": words, "warning": warning}
        self._update({"events": [*self._status["events"], event][-_EVENTS:]})

    def _update(self, values: Mapping[str, Any]) -> None:
        changed = {name: value for name, value in values.items() if self._status.get(name) != value}
        self._status |= changed
        self.version += bool(changed)


def _field(message: Any, path: str) -> Any:
    return attrgetter(path)(message)

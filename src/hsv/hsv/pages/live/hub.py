"""Current data of the flight: latest messages, a decimated history of the plotted quantities, faults, diagnostics."""

from __future__ import annotations

import threading
from collections import defaultdict, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hsv.bags.description import ACTUATOR, NOMINAL, STATE, TUBE_STATUS
from hsv.bags.messages import fault_in
from hsv.model.plant import FlightStatus
from hsv.pages.live.columns import columns, row

MOST_ROWS = 20_000
"""Rows of the history after which every second one is given up."""

_FIRST_ROWS = 1024

_KEPT = 16
"""Messages of a topic among which that of the newest whole step is found, however fast the flight is."""

_EVENTS = 200
"""Lines of what has happened that are kept."""


@dataclass(frozen=True)
class History:
    """Rows of the history from one on, and the number of the history, which changes when it restarts."""

    generation: int
    first: int
    rows: np.ndarray
    """Rows of time (s) and columns, single precision: (n, 1 + columns)."""


class Hub:
    """Collects the data of the page; written by one thread, read by the threads that serve it."""

    def __init__(self, decode: Callable[[str, bytes], Any], about: Mapping[str, str]) -> None:
        """Know nothing yet.

        Args:
            decode: Returns the message of a topic that is serialized in bytes.
            about: Further texts of the page: ``title``, and the path of the ``bag``; empty if unknown.
        """
        self.columns = columns()
        self._topics = tuple(dict.fromkeys(column.topic for column in self.columns))
        self._steady = frozenset(self._topics) - {TUBE_STATUS}
        """Topics that every step has; of the tube a controller of one's own says nothing."""
        self._decode = decode
        self._about = dict(about)
        self._lock = threading.Lock()
        self._generation = 0
        self._status: dict[str, Any] = {"run": None, "settings": {}, "limits": {}}
        self.version = 0
        """Counts the changes of what :meth:`status` says."""
        self._waiting: list[dict[str, bytes]] = []
        self._forget()

    def start_run(self, run_id: str, period: float, last_step: int) -> None:
        """Forget the run before."""
        with self._lock:
            self._forget()
            self._period = period
            self._status |= {"run": {"id": run_id, "period": period, "last_step": last_step}}
            self.version += 1

    def offer(self, topic: str, time: int, data: bytes) -> None:
        """Take a message of a step topic, serialized, of simulated ``time`` (ns)."""
        self._latest[topic].append((time, data))

    def say(self, **values: Any) -> None:
        """Change what :meth:`status` says: ``settings`` and ``limits`` by name, how the run ended, ``ending``."""
        with self._lock:
            self._say(values)

    def diagnose(self, node: str, level: int, words: str, values: Mapping[str, str]) -> None:
        """Store the diagnostics of a node."""
        with self._lock:
            entry = {"level": level, "words": words, "values": dict(values)}
            self._say({"diagnostics": self._status["diagnostics"] | {node: entry}})

    def note(self, words: str, *, step: int | None = None, warning: bool = False) -> None:
        """Add a line to the events, which takes effect or is reported at ``step``; None: now."""
        with self._lock:
            self._note(words, round(self.time * 1e-9 / self._period) if step is None else step, warning)

    def sample(self) -> bool:
        """Keep the newest step of which every topic is here, if it is new; return whether it was."""
        step = self._newest_step()
        if step is None:
            return False
        self._sampled = step[0]
        self._waiting.append(step[1])
        if len(self._waiting) > MOST_ROWS:
            self._waiting = self._waiting[::2]
        return True

    def decode(self, most: int = MOST_ROWS) -> None:
        """Add the rows of stored steps, the oldest ``most`` of them, for a viewer."""
        waiting, self._waiting = self._waiting[:most], self._waiting[most:]
        for serialized in waiting:
            messages = {topic: self._decode(topic, data) for topic, data in serialized.items()}
            values = row(self.columns, messages)
            with self._lock:
                if self._count == len(self._rows):
                    self._make_room()
                self._rows[self._count] = values
                self._count += 1
                self._say(self._said(messages))

    def history(self, generation: int, first: int) -> History:
        """Return the rows that are new to a reader who has those before ``first`` of a ``generation``."""
        with self._lock:
            first = first if generation == self._generation else 0
            return History(self._generation, first, self._rows[first : self._count].astype("<f4"))

    def status(self) -> dict[str, Any]:
        """Return everything but the rows, as plain data."""
        with self._lock:
            return {**self._about, **self._status}

    @property
    def time(self) -> int:
        """The simulated time (ns) of the newest state, 0 before there is one."""
        return self._latest[STATE][-1][0] if self._latest[STATE] else 0

    def end(self, status: int, step: int) -> None:
        """Note with which ``status`` of the vehicle, at which step, the run has ended; running: it was broken off."""
        how = {FlightStatus.FINISHED: "finished", FlightStatus.DIVERGED: "diverged"}
        self.say(ending={"how": how.get(FlightStatus(status), "broken off"), "time": round(step * self._period, 9)})

    def _forget(self) -> None:
        self._generation += 1
        self._latest: dict[str, deque[tuple[int, bytes]]] = defaultdict(lambda: deque(maxlen=_KEPT))
        self._rows = np.empty((_FIRST_ROWS, 1 + len(self.columns)), np.float32)
        self._count = 0
        self._sampled = -1
        self._waiting = []
        self._faults: dict[tuple[Any, ...], str] = {}
        self._period = 0.0
        self._status |= {"faults": [], "diagnostics": {}, "events": [], "ending": None, "tau": None}
        self._status |= {"tube_status": None, "nominal_status": 0}

    def _said(self, messages: Mapping[str, Any]) -> dict[str, Any]:
        """Return what a step says besides the rows."""
        actuator = messages[ACTUATOR]
        faults = [
            {"words": self._words(fault), "channel": fault.channel, "type": fault.type, "since": int(since)}
            for fault, since in zip(actuator.active, actuator.since, strict=True)
        ]
        self._note_faults(faults, int(messages[STATE].step))
        said = {"faults": faults, "nominal_status": messages[NOMINAL].status}
        if TUBE_STATUS in messages:
            tube = messages[TUBE_STATUS]
            said |= {"tau": [round(float(value), 12) for value in tube.tau], "tube_status": tube.status}
        return said

    def _note(self, words: str, step: int, warning: bool) -> None:
        event = {"time": round(step * self._period, 9), "step": step, "words": words, "warning": warning}
        self._say({"events": [*self._status["events"], event][-_EVENTS:]})

    def _note_faults(self, faults: list[dict[str, Any]], step: int) -> None:
        """Record which faults have started, scheduled or injected, and which have ended."""
        before = self._status["faults"]
        for fault in (fault for fault in faults if fault not in before):
            self._note(f"{fault['words']} begins", fault["since"], True)
        for fault in (fault for fault in before if fault not in faults):
            self._note(f"{fault['words']} has ended", step, False)

    def _words(self, fault: Any) -> str:
        """Return a fault in words, which takes longer than all the rest of a sample: once for each."""
        key = fault.channel, fault.type, *fault.parameter_names, *fault.parameter_values
        if key not in self._faults:
            self._faults[key] = str(fault_in(fault))
        return self._faults[key]

    def _say(self, values: Mapping[str, Any]) -> None:
        changed = {name: value for name, value in values.items() if self._status.get(name) != value}
        self._status |= changed
        self.version += bool(changed)

    def _make_room(self) -> None:
        if self._count < MOST_ROWS:
            self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
        else:
            self._generation += 1
            thinned = self._rows[: self._count : 2].copy()
            self._count = len(thinned)
            self._rows[: self._count] = thinned

    def _newest_step(self) -> tuple[int, dict[str, bytes]] | None:
        kept = {topic: self._latest[topic] for topic in self._topics if self._latest[topic]}
        if not kept.keys() >= self._steady:
            return None
        # The topics of a step come one after the other: of some, messages of later ones are here.
        time = min(messages[-1][0] for messages in kept.values())
        if time <= self._sampled:
            return None
        step = {
            topic: next((data for stamp, data in reversed(messages) if stamp == time), b"")
            for topic, messages in kept.items()
        }
        return (time, step) if all(step.values()) else None

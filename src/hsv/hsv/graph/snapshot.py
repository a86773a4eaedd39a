"""Snapshot of a running flight: a few numbers of a step, as a line between processes and for display."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Self

from hsv.base.units import UnitSystem, in_system, significant

_MARK = "flight "
"""Prefix of a line between processes."""


@dataclass(frozen=True)
class Snapshot:
    """A flight at one step, SI."""

    time: float
    altitude: float
    velocity_error: float
    """Error of the velocity, m/s"""
    tube_level: float | None
    """Level in the tube, at most 1 inside; ``None`` for a controller or a design without a tube."""
    faults: tuple[str, ...]
    """Channel and type of each active fault"""

    @classmethod
    def of(cls, state: Any, nominal: Any, status: Any | None, actuator: Any) -> Self:
        """Return it from the messages of a step: true state, nominal state, tube status (if any) and actuator."""
        stamp = state.header.stamp
        level = None if status is None or not isfinite(status.level) else float(status.level)
        return cls(
            time=stamp.sec + 1e-9 * stamp.nanosec,
            altitude=state.altitude,
            velocity_error=state.velocity - nominal.reference.velocity,
            tube_level=level,
            faults=tuple(f"{fault.channel} {fault.type}" for fault in actuator.active),
        )

    @property
    def line(self) -> str:
        """The line that :meth:`read` reads."""
        return _MARK + json.dumps(asdict(self))

    @classmethod
    def read(cls, line: str) -> Self | None:
        """Return the snapshot that a process has written in a line, ``None`` for other lines."""
        if not line.startswith(_MARK + "{"):
            return None
        values = json.loads(line.removeprefix(_MARK))
        return cls(**values | {"faults": tuple(values["faults"])})

    def in_words(self, system: UnitSystem) -> str:
        """Return it as text for display, with a fixed number of characters."""
        altitude, length = in_system(self.altitude, "m", system)
        error, speed = in_system(self.velocity_error, "m/s", system)
        level = "-" if self.tube_level is None else significant(self.tube_level)
        faults = ", ".join(self.faults).replace("_", " ") or "no fault"
        return (
            f"t {self.time:6.1f} s  h {altitude:7.0f} {length}  V off {error:+7.2f} {speed}  tube {level:>7}  {faults}"
        )

"""When faults act: from a step on, to another."""

from __future__ import annotations

from typing import NamedTuple

from hsv.base.timing import NEVER
from hsv.model.faults.table import Fault


class ScheduledFault(NamedTuple):
    """A fault that acts in the steps [start, stop)."""

    fault: Fault
    start: int
    stop: int = NEVER


class ActiveFault(NamedTuple):
    """A fault that acts, and since which step."""

    fault: Fault
    since: int

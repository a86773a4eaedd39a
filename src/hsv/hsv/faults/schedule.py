"""When faults act: from a step on, to another."""

from __future__ import annotations

from typing import NamedTuple

from hsv.faults.table import Fault
from hsv.timing import NEVER


class ScheduledFault(NamedTuple):
    """A fault that acts in the steps [start, stop)."""

    fault: Fault
    start: int
    stop: int = NEVER


class ActiveFault(NamedTuple):
    """A fault that acts, and since which step."""

    fault: Fault
    since: int

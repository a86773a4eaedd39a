"""Times and steps."""

from __future__ import annotations

import math

NEVER = 2**62
"""A step that is not reached."""


def first_step(time: float, period: float) -> int:
    """Return the first step k with k * ``period`` >= ``time`` (s), rounding of the division allowed for."""
    return math.ceil(time / period - 1e-9)

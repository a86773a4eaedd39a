"""The callback by which long computations report their progress."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Function of the stage, the number of finished items, and their total number."""

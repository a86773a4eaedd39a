"""The outcome of a command that a test runs in this process."""

from __future__ import annotations

import json
from dataclasses import dataclass


@dataclass
class Ran:
    """A finished command: its output and its exit code."""

    out: str
    err: str
    code: int

    @property
    def json(self):
        return json.loads(self.out)

    @property
    def error(self):
        """The one line of an error message; the command must have printed nothing else."""
        assert self.err.startswith("hsv: error: "), self.err
        assert self.err.endswith("\n")
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        return lines[0].removeprefix("hsv: error: ")

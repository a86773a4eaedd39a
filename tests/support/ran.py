"""The outcome of a command that a test has run in this process."""

from __future__ import annotations

import json
from dataclasses import dataclass


@dataclass
class Ran:
    """A command that has ended: what it printed and its exit code."""

    out: str
    err: str
    code: int

    @property
    def json(self):
        return json.loads(self.out)

    @property
    def error(self):
        """The one line of an error; nothing else may have been printed."""
        assert self.err.startswith("hsv: error: "), self.err
        assert self.err.endswith("\n")
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        return lines[0].removeprefix("hsv: error: ")

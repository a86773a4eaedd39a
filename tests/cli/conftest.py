from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hsv.cli.entry import COMMANDS, DESCRIPTION, MOVED
from hsv.cli.main import run as run_command_line


@dataclass
class Ran:
    """A command that has ended: what it printed and its exit code."""

    out: str
    err: str
    code: int

    @property
    def json(self) -> Any:
        return json.loads(self.out)

    @property
    def error(self) -> str:
        """The one line of an error; nothing else may have been printed."""
        assert self.err.startswith("hsv: error: "), self.err
        assert self.err.endswith("\n")
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        return lines[0].removeprefix("hsv: error: ")


@pytest.fixture
def hsv(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Callable[..., Ran]:
    """Run the command as the console script does, in an empty folder and in this process."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> Ran:
        monkeypatch.setattr("sys.argv", ["hsv", *words])
        with pytest.raises(SystemExit) as caught:
            run_command_line("hsv", COMMANDS, DESCRIPTION, MOVED)
        captured = capsys.readouterr()
        code = caught.value.code
        return Ran(captured.out, captured.err, 0 if code is None else int(code))

    return run

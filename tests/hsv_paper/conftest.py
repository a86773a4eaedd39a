from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from hsv_paper.cli import main


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
        (line,) = self.err.splitlines()
        assert line.startswith("hsv: error: ")
        return line.removeprefix("hsv: error: ")


@pytest.fixture
def hsv_paper(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> Callable[..., Ran]:
    """Run the command as the console script does, in an empty folder and in this process."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> Ran:
        monkeypatch.setattr("sys.argv", ["hsv-paper", *words])
        with pytest.raises(SystemExit) as caught:
            main()
        captured = capsys.readouterr()
        return Ran(captured.out, captured.err, int(caught.value.code or 0))

    return run

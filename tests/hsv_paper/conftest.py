from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from ran import Ran

from hsv_paper.cli import main


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

import pytest
from ran import Ran

from hsv_paper.cli import main


@pytest.fixture
def hsv_paper(monkeypatch, capsys, tmp_path):
    """Return a function that runs the command in this process, as the console script does, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr("sys.argv", ["hsv-paper", *words])
        with pytest.raises(SystemExit) as caught:
            main()
        captured = capsys.readouterr()
        return Ran(captured.out, captured.err, int(caught.value.code or 0))

    return run

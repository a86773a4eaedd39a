import pytest
from ran import Ran

from hsv.cli.entry import COMMANDS, DESCRIPTION
from hsv.cli.main import run as run_command_line


@pytest.fixture
def hsv(monkeypatch, capsys, tmp_path):
    """Return a function that runs the command in this process, as the console script does, in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr("sys.argv", ["hsv", *words])
        with pytest.raises(SystemExit) as caught:
            run_command_line("hsv", COMMANDS, DESCRIPTION)
        captured = capsys.readouterr()
        code = caught.value.code
        return Ran(captured.out, captured.err, 0 if code is None else int(code))

    return run

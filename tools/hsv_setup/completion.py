"""What shells complete the words of the hsv command by, as its command line library writes it; env.sh reads it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from hsv_setup.console import Stage
from hsv_setup.paths import STAMPS

SHELLS = ("bash", "zsh")

_WRITE = """
import sys
from pathlib import Path
from typer.completion import get_completion_script
for shell in sys.argv[2:]:
    text = get_completion_script(prog_name="hsv", complete_var="_HSV_COMPLETE", shell=shell)
    Path(sys.argv[1], f"completion.{shell}").write_text(text + "\\n")
"""


def write(python: Path, env: Mapping[str, str], stage: Stage) -> None:
    """Write a script a shell.

    Raises:
        SetupError: The library is not installed.
    """
    stage.run([python, "-c", _WRITE, STAMPS, *SHELLS], env)

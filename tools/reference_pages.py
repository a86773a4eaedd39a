"""Pages of the documentation's reference that are generated when it is built: commands and messages."""

from __future__ import annotations

import pkgutil
import re
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

MESSAGES = Path(__file__).parents[1] / "ros_ws" / "src" / "hsv_msgs"


def commands() -> str:
    """Return all commands and their options in Markdown, written by typer from what their ``--help`` prints.

    Raises:
        subprocess.CalledProcessError: If the command line cannot be imported.
    """
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "command_line.py")
        program.write_text(
            "from hsv.cli.entry import COMMANDS\nfrom hsv.cli.main import application\n\napp = application(COMMANDS)\n"
        )
        words = ["-m", "typer", str(program), "utils", "docs", "--name", "hsv"]
        text = subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True).stdout
    # Lists of commands have the beginnings of sentences alone, which stand whole under each command.
    text = re.sub(r"^\*\*Commands\*\*:\n\n(\* .*\n)+\n?", "", text, flags=re.MULTILINE)
    return re.sub(r"^# `hsv`$", "## `hsv`", text, flags=re.MULTILINE)


def messages(folder: Path = MESSAGES) -> str:
    """Return the definitions of all messages and services of a package in Markdown, comments included.

    Args:
        folder: The package, with its folders ``msg`` and ``srv``.
    """
    text = []
    for kind, title in (("msg", "Messages"), ("srv", "Services")):
        text.append(f"## {title}\n")
        for file in sorted((folder / kind).glob(f"*.{kind}")):
            text.append(f"### {file.stem}\n\n```text\n{file.read_text(encoding='utf-8')}```\n")
    return "\n".join(text)


def modules_of(package: str) -> list[str]:
    """Return the names of all modules of ``package``, of its packages too; of a module, none.

    Raises:
        ImportError: If there is none of this name.
    """
    paths = getattr(import_module(package), "__path__", ())
    return sorted(module.name for module in pkgutil.walk_packages(paths, f"{package}."))

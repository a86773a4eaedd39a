"""Pages of the documentation's reference that are generated when it is built: commands and messages."""

from __future__ import annotations

import pkgutil
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

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
    """Return all messages and services of a package in Markdown, each field with its comment.

    Args:
        folder: The package, with its folders ``msg`` and ``srv``.

    Raises:
        rosidl_adapter.parser.InvalidSpecification: If a file is no definition.
    """
    from rosidl_adapter.parser import parse_message_file, parse_service_file

    text = ["## Messages\n"]
    for file in sorted((folder / "msg").glob("*.msg")):
        message = parse_message_file(folder.name, str(file))
        text.append(f"### {file.stem}\n\n`{folder.name}/msg/{file.stem}`: {_comment(message)}\n\n{_table(message)}")
    text.append("## Services\n")
    for file in sorted((folder / "srv").glob("*.srv")):
        service = parse_service_file(folder.name, str(file))
        text.append(f"### {file.stem}\n\n`{folder.name}/srv/{file.stem}`: {_comment(service.request)}\n")
        text.append(f"Request:\n\n{_table(service.request)}")
        text.append(f"Response:\n\n{_table(service.response)}")
    return "\n".join(text)


def _table(message: Any) -> str:
    """Return fields and constants of a message as tables."""
    fields = [(f"`{field.name}`", f"`{field.type}`", _comment(field)) for field in message.fields]
    constants = [(f"`{item.name}`", f"`{item.type}`", f"{item.value}", _comment(item)) for item in message.constants]
    tables = [_rows(("field", "type", "unit and meaning"), fields)]
    if constants:
        tables.append(_rows(("constant", "type", "value", "meaning"), constants))
    return "\n".join(tables)


def _rows(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = [header, ("---",) * len(header), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _comment(item: Any) -> str:
    """Return what the definition says of a message, field or constant, safe in a table."""
    text = " ".join(item.annotations["comment"])
    return re.sub(r"([|*<_^$])", r"\\\1", text)


def modules_of(package: str) -> list[str]:
    """Return the names of all modules of ``package``, of its packages too; of a module, none.

    Raises:
        ImportError: If there is none of this name.
    """
    paths = getattr(import_module(package), "__path__", ())
    return sorted(module.name for module in pkgutil.walk_packages(paths, f"{package}."))

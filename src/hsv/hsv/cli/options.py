"""Arguments, options and help that several commands share, and the checks of the files that they name."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option, echo
from typer.core import TyperGroup

from hsv.base.errors import ParameterError, reason
from hsv.base.units import UnitSystem

BagArgument = Annotated[Path, Argument(help="Bag directory, or its .mcap file.")]
DesignArgument = Annotated[
    str, Argument(help="Design: a parameter file with its certificate next to it, or a shipped name.")
]
ScenarioArgument = Annotated[str, Argument(help="Name of a shipped scenario, or path of a TOML file.")]

ForceOption = Annotated[bool, Option("--force", help="Overwrite existing files.")]
GraphNamespaceOption = Annotated[str, Option("--namespace", help="Namespace of the graph, such as /veh1.")]
JsonOption = Annotated[bool, Option("--json", help="Print JSON, with the unit in every key.")]
ListJsonOption = Annotated[bool, Option("--json", help="Print JSON, with a unit for every number.")]
SetOption = Annotated[
    list[str] | None, Option("--set", help="Change a field, e.g. 'fault[0].effectiveness=0.7'; repeatable.")
]
SuppliedDesignOption = Annotated[Path | None, Option("--design", help="Design of a bag without attachments.")]
SuppliedScenarioOption = Annotated[str | None, Option("--scenario", help="Scenario of a bag without attachments.")]
TrustOption = Annotated[bool, Option("--trust", help="Run code that the file names, such as controllers.")]
UnitsOption = Annotated[UnitSystem, Option(help="SI with degrees and percent, strict SI, or ft, ft/s, deg.")]


class Group(TyperGroup):
    """A group of commands whose help lists them by subject, each with the first paragraph of its description."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Print the help, with exit code 2, if a group that needs a command is given none."""
        if not args and self.no_args_is_help:
            echo(ctx.get_help())
            ctx.exit(2)
        return super().parse_args(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and descriptions of the commands that are not hidden, under the headings of their subjects."""
        subjects: dict[str, list[tuple[str, str]]] = {}
        width = max(map(len, self.commands))
        for name, command in self.commands.items():
            if not command.hidden:
                heading = getattr(command, "rich_help_panel", None) or "Commands"
                subjects.setdefault(heading, []).append((name.ljust(width), (command.help or "").split("\n\n")[0]))
        for heading, rows in subjects.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


def check_target(path: Path, field: str, *suffixes: str) -> None:
    """Refuse a file whose name does not end in one of the ``suffixes`` (if any), or that cannot be written."""
    if suffixes and path.suffix not in suffixes:
        ends = " or ".join(filter(None, (", ".join(suffixes[:-1]), suffixes[-1])))
        raise ParameterError(f"{field} = {str(path)!r}: expected a file that ends in {ends}")
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written (not a regular file)")
    usable = os.access(path, os.W_OK) and not path.is_dir() if path.exists() else _takes_files(path.parent)
    if not usable:
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written, expected a file in an existing folder")


def check_new(path: Path, field: str, force: bool) -> None:
    """Refuse a file that cannot be written or, without ``force``, one that exists."""
    check_target(path, field)
    if path.exists() and not force:
        raise ParameterError(f"{field} = {str(path)!r}: exists, expected a new file, or --force to overwrite it")


def check_folder(path: Path, field: str) -> None:
    """Refuse a folder that cannot be written to or created; the folder is not created here."""
    there = path.absolute()
    while not os.path.lexists(there):
        there = there.parent
    if not _takes_files(there):
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written, expected a folder or the name of a new one")


@contextmanager
def writing(path: Path, field: str) -> Iterator[None]:
    """Turn a system error that occurs while ``path`` is written into a ``ParameterError``, and remove the file."""
    try:
        yield
    except OSError as error:
        if path.is_file():
            path.unlink()
        raise ParameterError(f"{field} = {str(path)!r}: cannot be written ({reason(error)})") from error


def _takes_files(folder: Path) -> bool:
    # To check the permissions is not enough: the file system may be read-only, or may not hold files.
    try:
        from tempfile import mkdtemp

        Path(mkdtemp(dir=folder)).rmdir()
    except OSError:
        return False
    return True

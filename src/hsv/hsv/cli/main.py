"""Build and run a command line: errors on one line, exit code 0 only on success."""

from __future__ import annotations

import builtins
import inspect
import os
import re
import sys
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Option
from typer.completion import completion_init
from typer.core import TyperCommand

import hsv
from hsv.base.errors import HsvError, QuantityError, RunError, did_you_mean, one_of, reason
from hsv.cli.options import Group
from hsv.cli.output import Interrupted, console, report_error

if TYPE_CHECKING:
    from hsv.cli.entry import Command

_HELP = ("-h", "--help")

_INTERRUPTED = 130

EXIT_CODES = {
    0: "done",
    1: "failed, or the result is negative: a flight lost, a claim or comparison that does not hold, a check of "
    "`hsv verify` that fails, a design for only a share of its disturbances (`design`, `verify`)",
    2: "refused: bad input, or a file that cannot be read or written",
    _INTERRUPTED: "interrupted",
}
"""Meaning of each exit code of the command."""

EXTRAS = {
    "clarabel": "design",
    "control": "notebook",
    "cvxpy": "design",
    "distributed": "campaign",
    "fmpy": "fmi",
    "foxglove": "live",
    "gymnasium": "gym",
    "jinja2": "report",
    "markupsafe": "report",
    "matplotlib": "report",
    "pandas": "notebook",
    "pyarrow": "campaign",
    "websockets": "live",
}
"""Modules that the base installation lacks, and the extra of the package that installs each of them."""

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""Error for an unknown option, a missing argument and the like; typer exports only this subclass of it."""


class _StrictCommand(TyperCommand):
    """A command that refuses empty texts and the repetition of a single-valued option (typer would use the last)."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        values, _, given = self.make_parser(ctx).parse_args(args=[*args])
        for parameter in given:
            if given.count(parameter) > 1 and not getattr(parameter, "multiple", True):
                raise QuantityError(f"{parameter.opts[0]}: given twice, expected once")
            if values[parameter.name] == "":
                raise QuantityError(f"{parameter.opts[0]} = '': expected a text that is not empty")
        return super().parse_args(ctx, args)


def application(commands: Mapping[str, Command], *, prog: str = "hsv", listed: bool = False) -> typer.Typer:
    """Return a command line, and import the modules of its commands.

    Args:
        commands: Places of the commands by name. A command ``a-b`` is the function, or group of commands, ``a_b`` of
            its module, with an underscore at the end if ``a_b`` is a Python builtin.
        prog: Name of the command line.
        listed: Whether only names and descriptions are needed, as for ``hsv --help``; building the options takes long.
    """
    app = typer.Typer(
        name=prog,
        cls=Group,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": [*_HELP]},
        epilog="Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    )
    app.callback()(options)
    groups = [app]
    for name, (module, panel) in commands.items():
        attribute = name.replace("-", "_")
        command = getattr(import_module(module), attribute + "_" * hasattr(builtins, attribute))
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name, rich_help_panel=panel)
            groups.append(command)
        else:
            shown = _without_options(command) if listed else command
            app.command(name, rich_help_panel=panel, hidden=not panel)(shown)
    for group in groups:
        for registered in group.registered_commands:
            registered.cls = _StrictCommand
            # Join the lines of each paragraph, because typer keeps the line breaks of all paragraphs but the first.
            paragraphs = (inspect.getdoc(registered.callback) or "").split("\n\n")
            registered.help = "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)
    return app


def _without_options(command: Callable[..., Any]) -> Callable[[], None]:
    def listed() -> None: ...

    listed.__doc__ = command.__doc__
    return listed


def _version(requested: bool) -> None:
    if requested:
        console.print(f"hsv {hsv.__version__}")
        raise typer.Exit


def options(
    version: Annotated[
        bool, Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    traceback: Annotated[
        bool, Option("--traceback", envvar="HSV_TRACEBACK", help="Print the traceback of errors, too.")
    ] = False,
) -> None:
    """Declare the options that precede a command."""


def run(prog: str, commands: Mapping[str, Command], description: str) -> None:
    """Run a command line and exit; bad input gives one line and exit code 2, a failed run exit code 1.

    Args:
        prog: Name of the command line.
        commands: Places of its commands by name.
        description: First sentence of its help.
    """
    completing = f"_{prog.upper()}_COMPLETE" in os.environ
    if completing:
        completion_init()  # a shell requests the words that may come next
    words = sys.argv[1:] or ["--help"]
    end = words.index("--") if "--" in words else len(words)
    if "--traceback" in words[1:end]:
        words = ["--traceback", *(word for word in words[:end] if word != "--traceback"), *words[end:]]
    if words[0] == "--traceback":
        os.environ["HSV_TRACEBACK"] = "1"
    first = next((word for word in words if word != "--traceback"), "")
    try:
        if first not in commands and not first.startswith("-"):
            hint = did_you_mean(first, [name for name, command in commands.items() if command.panel])
            raise QuantityError(f"command {first!r}: unknown{hint} (see {prog} --help)")
        # Build only the given command: to build all of them takes as long as to import numpy.
        listed = first in _HELP and not completing
        app = application({first: commands[first]} if first in commands else commands, prog=prog, listed=listed)
        app.info.help = description
        # Outside typer's standalone mode, a usage error is one line as well.
        code = app(words, prog_name=prog, standalone_mode=False)
        if code == _INTERRUPTED:
            raise KeyboardInterrupt  # typer turns the exception into this code
        if sys.stdout:
            sys.stdout.flush()
        sys.exit(code)
    except SystemExit:
        if {*_HELP} & {*words}:
            _end(0)  # typer ends with 1 if the reader of a help has read enough
        raise
    except UsageError as error:
        _fail(_usage(error, prog), 2)
    except RunError as error:
        _fail(error, 1)
    except HsvError as error:
        _fail(error, 2)
    except Interrupted as interrupted:
        _fail(interrupted, _INTERRUPTED)
    except (KeyboardInterrupt, typer.Abort):
        _fail("interrupted", _INTERRUPTED)
    except SystemError as error:
        # numpy goes on with an array of fractions after an interruption, which Python takes for an error of its own.
        cause: BaseException = error
        while cause.__cause__:
            cause = cause.__cause__
        if not isinstance(cause, KeyboardInterrupt):
            raise
        _fail("interrupted", _INTERRUPTED)
    except ModuleNotFoundError as error:
        extra = EXTRAS.get((error.name or "").partition(".")[0])
        if not extra:
            raise
        _fail(f"needs hsv[{extra}]: pip install './src/hsv[{extra}]'", 2)
    except BrokenPipeError:
        _end(1)  # The reader of the pipe is gone; end silently, as click and rich do.
    except OSError as error:
        # The system names a file that it fails to open, but not an output that it fails to write.
        place = f"{error.filename}: cannot be opened" if error.filename else "output: cannot be written"
        _fail(f"{place} ({reason(error)})", 2)


def _usage(error: Any, prog: str) -> str:
    """Return typer's error as one line; wrong values and missing choices are worded as in the library's own errors."""
    message = " ".join(error.format_message().split())
    if parameter := getattr(error, "param", None):
        name = max(parameter.opts, key=len).lstrip("-")
        if hasattr(error.__cause__, "errors"):  # from pydantic, which converts the words
            wrong = error.__cause__.errors()[0]
            expected = re.sub("^Input should be (?=greater|less)", "a number ", wrong["msg"])
            expected = expected.removeprefix("Input should be ").partition(", unable")[0]
            if choices := re.search(r" is not one of (.*)\.$", expected):
                expected = one_of(re.findall(r"'([^']*)'", choices[1]), wrong["input"])
            return f"{name} = {wrong['input']!r}: expected {expected}"
        if choices := re.search("Choose from: (.*)", message):
            return f"{name}: missing, expected one of {choices[1]}"
    return f"{message} (see {error.ctx.command_path if error.ctx else prog} --help)"


def _fail(problem: object, code: int) -> None:
    with suppress(OSError):
        if os.environ.get("HSV_TRACEBACK", "0") not in ("", "0"):
            traceback.print_exc()
        report_error(problem)
    _end(code)


def _end(code: int) -> None:
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            # Otherwise Python flushes again at exit, prints an error on several lines, and changes the exit code.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(code)

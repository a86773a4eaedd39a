"""The hsv command: one file a command, errors on one line, exit code 0 only on success."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.completion import completion_init

import hsv
from hsv.base.errors import HsvError, QuantityError, RunError, reason
from hsv.cli.extras import missing_extra
from hsv.cli.output import Interrupted, console, report_error

_HELP = ("-h", "--help")

_INTERRUPTED = 130

EXIT_CODES = {
    0: "done",
    1: "failed, or the result is negative: a flight lost, a claim or comparison that does not hold",
    2: "refused: bad input, or a file that cannot be read or written",
    _INTERRUPTED: "interrupted",
}
"""Meaning of each exit code of the command."""

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""Error for an unknown option, a missing argument and the like; typer exports only this subclass of it."""

COMMANDS = (
    "trim",
    "linearise",
    "design",
    "verify",
    "certify",
    "check",
    "scenarios",
    "govern",
    "vehicles",
    "equipment",
    "faults",
    "simulate",
    "run",
    "prepare",
    "conclude",
    "include",
    "info",
    "plot",
    "report",
    "view",
    "replay",
    "play",
    "diff",
    "recover",
    "export",
    "export-controller",
    "bench",
    "resilience",
    "cluster",
    "set",
    "command",
    "topic",
    "watch",
    "montecarlo",
    "fault",
)
"""Names of the commands; each is in a module of this name, with underscores, a function or a group of commands."""

DESCRIPTION = "Fly a flexible air-breathing hypersonic vehicle under Tube-MPC, software in the loop."

MOVED = {"figures": "hsv-paper figures", "claims": "hsv-paper claims", "study": "hsv-paper sensitivity"}
"""New names of commands that were renamed."""


def application(
    names: Sequence[str] = COMMANDS, *, prog: str = "hsv", package: str = "hsv.cli", listed: bool = False
) -> typer.Typer:
    """Return a command line with commands of these names, whose modules are imported.

    Args:
        names: Names of the commands.
        prog: Name of the command line.
        package: Package of the commands' modules.
        listed: Whether only names and descriptions are needed, as for ``hsv --help``: options take most of the time.
    """
    app = typer.Typer(
        name=prog,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": [*_HELP]},
        epilog="Exit codes: " + "; ".join(f"{code} {meaning}" for code, meaning in EXIT_CODES.items()) + ".",
    )
    app.callback()(options)
    groups = [app]
    for name in names:
        attribute = name.replace("-", "_")
        command = getattr(import_module(f"{package}.{attribute}"), attribute)
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
            groups.append(command)
        else:
            app.command(name)(_without_options(command) if listed else command)
    for group in groups:
        for registered in group.registered_commands:
            # Folded to the terminal only: typer keeps the line breaks of the source in all paragraphs but the first.
            paragraphs = (inspect.getdoc(registered.callback) or "").split("\n\n")
            registered.help = "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)
    return app


def _without_options(command: Callable[..., Any]) -> Callable[[], None]:
    def listed() -> None: ...

    listed.__doc__ = command.__doc__
    return listed


def _version(wanted: bool) -> None:
    if wanted:
        console.print(f"hsv {hsv.__version__}")
        raise typer.Exit


def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Fly a flexible air-breathing hypersonic vehicle under Tube-MPC, software in the loop."""


def main() -> None:
    """Run the command ``hsv``."""
    run("hsv", "hsv.cli", COMMANDS, DESCRIPTION)


def run(prog: str, package: str, commands: Sequence[str], description: str) -> None:
    """Run a command line; bad input ends with one line and exit code 2, a failed run with exit code 1.

    Args:
        prog: Its name.
        package: Package of the modules of its commands.
        commands: Names of its commands.
        description: One sentence, the first of its help.
    """
    completing = f"_{prog.upper()}_COMPLETE" in os.environ
    if completing:
        completion_init()  # a shell asks for the words that may come next
    try:
        # Out of typer's standalone mode, so that a usage error is one line as well.
        words = sys.argv[1:] or ["--help"]
        if prog == "hsv" and (moved := MOVED.get(words[0])):
            raise QuantityError(f"hsv {words[0]} is called {moved} now")
        # One command is wanted: the modules of all, and what typer makes of them, take as long as numpy.
        listed = words[0] in _HELP and not completing
        names = words[:1] if words[0] in commands else commands
        app = application(names, prog=prog, package=package, listed=listed)
        app.info.help = description
        code = app(words, prog_name=prog, standalone_mode=False)
        if code == _INTERRUPTED:
            raise KeyboardInterrupt  # typer swallows it
        if sys.stdout:
            sys.stdout.flush()
        sys.exit(code)
    except UsageError as error:
        _fail(_usage(error), 2)
    except RunError as error:
        _fail(error, 1)
    except HsvError as error:
        _fail(error, 2)
    except Interrupted as interrupted:
        _fail(interrupted, _INTERRUPTED)
    except (KeyboardInterrupt, typer.Abort):
        _fail("interrupted", _INTERRUPTED)
    except ImportError as error:
        if extra := missing_extra(error):
            _fail(f"needs hsv[{extra}]: pip install 'hsv[{extra}]'", 2)
        raise
    except BrokenPipeError:
        _end(1)  # Nobody reads any more: no more words either, as of click and rich.
    except OSError as error:
        # Of a file that it fails to open, the system says the name; not of the output that it fails to write.
        place = f"{error.filename}: cannot be opened" if error.filename else "output: cannot be written"
        _fail(f"{place} ({reason(error)})", 2)


def _usage(error: Any) -> str:
    # Of a choice, typer reports the type of its own exception, too.
    message = error.format_message().replace(": Value error, ", ": ")
    return f"{message} (see {error.ctx.command_path if error.ctx else 'hsv'} --help)"


def _fail(problem: object, code: int) -> None:
    with suppress(OSError):
        report_error(problem)
    _end(code)


def _end(code: int) -> None:
    for stream in filter(None, (sys.stdout, sys.stderr)):
        try:
            stream.flush()
        except OSError:
            # Python would try once more at its end, complain on several lines, and change the exit code.
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    sys.exit(code)


if __name__ == "__main__":
    main()

"""The entry point of the ``hsv`` command, and the table of its commands."""

from __future__ import annotations

import os
import sys
from typing import NamedTuple

from hsv.base.processes import take_interrupts

DESCRIPTION = "Fly a flexible air-breathing hypersonic vehicle under Tube-MPC, software in the loop."

TREE = (
    ("Fly", "hsv.cli.fly", "run simulate"),
    ("Fly", "hsv.cli.campaigns", "montecarlo resilience"),
    ("Fly", "hsv.cli.search", "worst rare"),
    ("Look at flights", "hsv.cli.look", "report plot info"),
    ("Look at flights", "hsv.cli.compare", "compare"),
    ("In flight", "hsv.cli.in_flight", "fault set command watch topic"),
    ("Bags", "hsv.cli.bags", "replay diff export recover play"),
    ("Design", "hsv.cli.models", "trim linearise"),
    ("Design", "hsv.cli.design", "design verify certify govern"),
    ("Design", "hsv.cli.margins", "margins"),
    ("Design", "hsv.cli.code", "export-controller export-vehicle"),
    ("Know", "hsv.cli.know", "list check bench"),
    ("", "hsv.cli.fly", "prepare conclude"),
    ("", "hsv.cli.code", "include"),
)
"""The commands by subject: heading in the help, module, names. Commands without a heading are hidden."""


class Command(NamedTuple):
    """Place of a command: the module that defines it, and its heading in the help (empty: it is not listed)."""

    module: str
    panel: str = "Commands"


COMMANDS = {name: Command(module, panel) for panel, module, names in TREE for name in names.split()}


def main() -> None:
    """Run the command line; Ctrl-C ends it with a message of one line, even while modules are loaded."""
    try:
        # SIGTERM then also ends child processes and removes temporary files, as Ctrl-C does.
        take_interrupts()
        # Without plugins, here and in child processes, pydantic need not search all installed packages for them.
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
        from hsv.cli.main import run

        run("hsv", COMMANDS, DESCRIPTION)
    except KeyboardInterrupt:
        print("hsv: error: interrupted", file=sys.stderr, flush=True)
        os._exit(130)


if __name__ == "__main__":
    main()

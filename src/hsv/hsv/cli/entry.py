"""The ``hsv`` script: the command line, whose imports take a moment in which Ctrl-C may come as well."""

from __future__ import annotations

import os
import sys

from hsv.base.interruption import take_interrupts


def main() -> None:
    """Run the command line; interrupted before it begins it ends with one line, as later on."""
    try:
        # The whole command: asked to end, it ends its processes and removes its temporary files as after Ctrl-C.
        take_interrupts()
        from hsv.cli.main import main as command_line

        command_line()
    except KeyboardInterrupt:
        print("hsv: error: interrupted", file=sys.stderr, flush=True)
        os._exit(130)

"""The ``hsv`` script: the command line, whose imports take a moment in which Ctrl-C may come as well."""

from __future__ import annotations

import os
import signal
import sys


def main() -> None:
    """Run the command line; interrupted while it is imported it ends with one line, as later on."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        # The script may have been started with it blocked.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT,))
        from hsv.cli.main import main as command_line
    except KeyboardInterrupt:
        print("hsv: error: interrupted", file=sys.stderr, flush=True)
        os._exit(130)
    command_line()

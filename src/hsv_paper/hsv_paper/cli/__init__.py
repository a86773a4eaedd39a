"""The hsv-paper command: the paper's figures and claims, and what its choices are sensitive to."""

from __future__ import annotations

from hsv.cli.entry import Command
from hsv.cli.main import run

COMMANDS = {name: Command(f"{__name__}.{name}") for name in ("figures", "claims", "sensitivity")}
"""Places of the commands: each is in a module of this name."""


def main() -> None:
    """Run the command line."""
    run("hsv-paper", COMMANDS, "Draw the figures of the paper, judge its claims, and vary its choices.")

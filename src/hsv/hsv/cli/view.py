"""The command ``hsv view``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.output import console


class Program(StrEnum):
    """A viewer that can be asked for."""

    foxglove = "foxglove"
    lichtblick = "lichtblick"
    plotjuggler = "plotjuggler"
    rerun = "rerun"


def view(
    bag: Annotated[Path, typer.Argument(help="Bag directory, or its .mcap file.")],
    program: Annotated[
        Program | None, typer.Option("--with", help="Viewer; default: the first that is installed.")
    ] = None,
) -> None:
    """Open a bag in Foxglove, Lichtblick, PlotJuggler or Rerun, whichever is installed.

    Example: hsv view bags/case1_20260101T000000Z --with plotjuggler
    """
    import subprocess

    from hsv.errors import RecordingError
    from hsv.recording.reader import find_mcap
    from hsv.recording.viewers import VIEWERS

    mcap = find_mcap(bag).absolute()
    wanted = [VIEWERS[program]] if program else list(VIEWERS.values())
    for viewer in wanted:
        command = viewer.command(mcap)
        if command:
            console.print(f"opening {mcap} with {viewer.name}", soft_wrap=True)
            if viewer.layout:
                console.print(f"layout to import there: {viewer.layout}", soft_wrap=True)
            subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL)
            return
    sources = "; ".join(f"{viewer.name}: {viewer.source}" for viewer in wanted)
    raise RecordingError(
        f"{mcap}: no viewer is installed, expected one of these ({sources}); "
        f"or drop the file into a browser at https://app.foxglove.dev, or use: hsv report {bag}"
    )

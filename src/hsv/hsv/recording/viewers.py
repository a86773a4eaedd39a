"""Programs that show a bag, if they are installed, and the layouts for them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

LAYOUTS = Path(str(files("hsv.recording").joinpath("layouts")))
"""Folder of the layouts."""


@dataclass(frozen=True)
class Viewer:
    """A program that opens an MCAP file."""

    name: str
    programs: tuple[str, ...]
    """Names under which it may be installed."""
    arguments: Callable[[Path], list[str]]
    """From the MCAP file to the arguments of the program."""
    layout: Path | None
    """A layout to be imported in the program by hand; None where there is none or the arguments name it."""
    source: str
    """Where to get it."""

    def command(self, mcap: Path) -> list[str] | None:
        """Return the command that opens ``mcap``, None if the program is not installed."""
        found = next(filter(None, map(shutil.which, self.programs)), None)
        return [found, *self.arguments(mcap)] if found else None


def _file(mcap: Path) -> list[str]:
    return [str(mcap)]


def _plotjuggler(mcap: Path) -> list[str]:
    return ["--datafile", str(mcap), "--layout", str(LAYOUTS / "plotjuggler.xml")]


VIEWERS = {
    "foxglove": Viewer(
        "Foxglove",
        ("foxglove-studio", "foxglove-desktop"),
        _file,
        LAYOUTS / "foxglove.json",
        "https://foxglove.dev/download",
    ),
    "lichtblick": Viewer(
        "Lichtblick",
        ("lichtblick",),
        _file,
        LAYOUTS / "foxglove.json",
        "https://github.com/lichtblick-suite/lichtblick/releases",
    ),
    "plotjuggler": Viewer(
        "PlotJuggler",
        ("plotjuggler",),
        _plotjuggler,
        None,
        "https://plotjuggler.io, or: apt install ros-jazzy-plotjuggler-ros",
    ),
    "rerun": Viewer("Rerun", ("rerun",), _file, None, "pip install rerun-sdk"),
}
"""In the order in which they are tried."""

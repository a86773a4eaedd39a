"""Programs that display a bag, and the layout file for them."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import NamedTuple

from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError
from hsv.pages.layouts import foxglove_layout


class Viewer(NamedTuple):
    """A program that opens MCAP files: its executables, where to get it, and the options before the file."""

    name: str
    programs: tuple[str, ...]
    source: str
    options: tuple[str, ...] = ()
    scene: bool = False
    """Whether the program draws the vehicle in 3-D, from a copy of the bag and with a layout imported by hand."""

    def program(self) -> str | None:
        """Return the path of the installed executable, or None."""
        return next(filter(None, map(shutil.which, self.programs)), None)


_LICHTBLICK = "https://github.com/lichtblick-suite/lichtblick/releases"
_PLOTJUGGLER = "https://plotjuggler.io, or: apt install ros-jazzy-plotjuggler-ros"
VIEWERS = {
    "foxglove": Viewer(
        "Foxglove", ("foxglove-studio", "foxglove-desktop"), "https://foxglove.dev/download", scene=True
    ),
    "lichtblick": Viewer("Lichtblick", ("lichtblick",), _LICHTBLICK, scene=True),
    "plotjuggler": Viewer("PlotJuggler", ("plotjuggler",), _PLOTJUGGLER, ("--datafile",)),
    "rerun": Viewer("Rerun", ("rerun",), "pip install rerun-sdk"),
}
"""Viewers in the order in which they are tried."""


def layout_for(bag: Bag) -> Path:
    """Write the layout for the topics of ``bag`` into the bag's folder, and return its path.

    Raises:
        RecordingError: The layout cannot be written.
    """
    target = bag.folder / "layout_foxglove.json"
    try:
        target.write_text(foxglove_layout(bag.name_of), encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"{target}: the layout cannot be written: {error.strerror}") from None
    return target

"""Programs that show a bag, if they are installed, and the layouts for them."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError
from hsv.pages.layouts import LAYOUTS


@dataclass(frozen=True)
class Viewer:
    """A program that opens an MCAP file."""

    name: str
    programs: tuple[str, ...]
    """Names under which it may be installed."""
    arguments: tuple[str, ...]
    """Arguments of the program, with ``{mcap}`` and ``{layout}`` for the paths of the MCAP file and the layout."""
    layout: str
    """File name of the layout; empty without one."""
    imports: bool
    """Whether the layout has to be imported in the program by hand."""
    source: str
    """Address of the download."""
    scene: bool = False
    """Whether the viewer draws the vehicle in 3-D, from a copy of the bag."""

    def program(self) -> str | None:
        """Return the path of the program, None if it is not installed."""
        return next(filter(None, map(shutil.which, self.programs)), None)


def layout_for(bag: Bag, name: str) -> Path:
    """Write the layout file ``name`` for the topics of ``bag`` into the bag's folder, and return its path.

    Raises:
        RecordingError: It cannot be written.
    """
    target = bag.folder / f"layout_{name}"
    try:
        target.write_text(LAYOUTS[name](bag.name_of), encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"{target}: the layout cannot be written: {error.strerror}") from None
    return target


VIEWERS = {
    "foxglove": Viewer(
        "Foxglove",
        ("foxglove-studio", "foxglove-desktop"),
        ("{mcap}",),
        "foxglove.json",
        True,
        "https://foxglove.dev/download",
        scene=True,
    ),
    "lichtblick": Viewer(
        "Lichtblick",
        ("lichtblick",),
        ("{mcap}",),
        "foxglove.json",
        True,
        "https://github.com/lichtblick-suite/lichtblick/releases",
        scene=True,
    ),
    "plotjuggler": Viewer(
        "PlotJuggler",
        ("plotjuggler",),
        ("--datafile", "{mcap}", "--layout", "{layout}"),
        "plotjuggler.xml",
        False,
        "https://plotjuggler.io, or: apt install ros-jazzy-plotjuggler-ros",
    ),
    "rerun": Viewer("Rerun", ("rerun",), ("{mcap}",), "", False, "pip install rerun-sdk"),
}
"""Viewers in the order in which they are tried."""

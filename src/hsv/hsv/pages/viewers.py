"""Programs that show a bag, if they are installed, and the layouts for them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from hsv.bags.description import DIAGNOSTICS, TOPICS, resolved
from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError

LAYOUTS = Path(str(files("hsv.pages").joinpath("layouts")))
"""Folder of the layouts."""


@dataclass(frozen=True)
class Viewer:
    """A program that opens an MCAP file."""

    name: str
    programs: tuple[str, ...]
    """Names under which it may be installed."""
    arguments: Callable[[Path, Path | None], list[str]]
    """Function from the MCAP file and the layout to the arguments of the program."""
    layout: str
    """File name of the layout; empty where there is none."""
    imports: bool
    """Whether the layout has to be imported in the program by hand."""
    source: str
    """Address from which to get it."""
    scene: bool = False
    """Whether it draws the vehicle in 3-D, from a file that the bag is copied to."""

    def program(self) -> str | None:
        """Return the path of the program, None if it is not installed."""
        return next(filter(None, map(shutil.which, self.programs)), None)


def layout_for(bag: Bag, name: str) -> Path:
    """Return the layout of file name ``name`` for the topics of ``bag``.

    That is the shipped one, or, for a graph in a namespace or with remapped topics, one beside the bag, written now.

    Raises:
        RecordingError: It cannot be written.
    """
    shipped = LAYOUTS / name
    names = {resolved(role): bag.name_of(role) for role in (*TOPICS, DIAGNOSTICS)}
    if all(usual == name for usual, name in names.items()):
        return shipped
    # What follows a topic in a layout is a field, or the end of the text.
    pattern = re.compile(rf"(?<=[\">])({'|'.join(map(re.escape, names))})(?=[./\"<])")
    target = bag.folder / f"layout_{name}"
    try:
        target.write_text(
            pattern.sub(lambda found: names[found[1]], shipped.read_text(encoding="utf-8")), encoding="utf-8"
        )
    except OSError as error:
        raise RecordingError(f"{target}: the layout cannot be written: {error.strerror}") from None
    return target


def _file(mcap: Path, _: Path | None) -> list[str]:
    return [str(mcap)]


def _plotjuggler(mcap: Path, layout: Path | None) -> list[str]:
    return ["--datafile", str(mcap), "--layout", str(layout)]


VIEWERS = {
    "foxglove": Viewer(
        "Foxglove",
        ("foxglove-studio", "foxglove-desktop"),
        _file,
        "foxglove.json",
        True,
        "https://foxglove.dev/download",
        scene=True,
    ),
    "lichtblick": Viewer(
        "Lichtblick",
        ("lichtblick",),
        _file,
        "foxglove.json",
        True,
        "https://github.com/lichtblick-suite/lichtblick/releases",
        scene=True,
    ),
    "plotjuggler": Viewer(
        "PlotJuggler",
        ("plotjuggler",),
        _plotjuggler,
        "plotjuggler.xml",
        False,
        "https://plotjuggler.io, or: apt install ros-jazzy-plotjuggler-ros",
    ),
    "rerun": Viewer("Rerun", ("rerun",), _file, "", False, "pip install rerun-sdk"),
}
"""Viewers in the order in which they are tried."""

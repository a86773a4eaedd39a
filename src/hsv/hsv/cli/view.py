"""The command ``hsv view``."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import BagArgument, JsonOption
from hsv.cli.output import console, print_json


class Program(StrEnum):
    """A viewer that can be asked for."""

    foxglove = "foxglove"
    lichtblick = "lichtblick"
    plotjuggler = "plotjuggler"
    rerun = "rerun"


def view(
    bag: BagArgument,
    program: Annotated[
        Program | None, typer.Option("--with", help="Viewer; default: the first that is installed.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Open a bag in Foxglove, Lichtblick, PlotJuggler or Rerun, whichever is installed.

    Foxglove and Lichtblick show the vehicle in 3-D: they open a copy with a 3-D scene, in the folder scene of the bag.

    Example: hsv view bags/case1_20260101T000000Z --with plotjuggler
    """
    import subprocess

    from hsv.bags.reader import Bag
    from hsv.bags.scene import scene_of
    from hsv.base.errors import RecordingError
    from hsv.pages.viewers import VIEWERS, layout_for

    opened = Bag(bag)
    if len(opened.files) != 1 or opened.path.suffix != ".mcap":
        raise RecordingError(
            f"{opened.path}: viewers open one MCAP file, expected a bag that is neither split nor compressed by rosbag2"
        )
    mcap = opened.path.absolute()
    wanted = [VIEWERS[program]] if program else list(VIEWERS.values())
    for viewer in wanted:
        found = viewer.program()
        if found:
            made = layout_for(opened, viewer.layout) if viewer.layout else None
            if viewer.scene:
                mcap = scene_of(opened).absolute()
            command = [found, *viewer.arguments(mcap, made)]
            subprocess.Popen(command, start_new_session=True, stdin=subprocess.DEVNULL)
            layout = str(made) if viewer.imports else None
            if json:
                print_json({"path": str(mcap), "viewer": viewer.name, "command": command, "layout_to_import": layout})
            else:
                console.print(f"opening {mcap} with {viewer.name}", soft_wrap=True)
                if layout:
                    console.print(f"layout to import there: {layout}", soft_wrap=True)
            print_bag_warnings(opened)
            return
    sources = "; ".join(f"{viewer.name}: {viewer.source}" for viewer in wanted)
    raise RecordingError(
        f"{mcap}: no viewer is installed, expected one of these ({sources}); "
        f"or drop the file into a browser at https://app.foxglove.dev, or use: hsv report {bag}"
    )

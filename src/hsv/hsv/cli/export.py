"""The command ``hsv export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import BagArgument, JsonOption
from hsv.cli.output import print_written


def export(
    bag: BagArgument,
    csv: Annotated[bool, typer.Option("--csv", help="A folder of CSV files, one per topic.")] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="A folder of Parquet files, one per topic.")] = False,
    npz: Annotated[bool, typer.Option("--npz", help="One .npz file.")] = False,
    scene: Annotated[
        bool,
        typer.Option(
            "--scene", help="One MCAP file: a copy of the bag with the vehicle in 3-D, for Foxglove and Lichtblick."
        ),
    ] = False,
    exaggeration: Annotated[
        float | None, typer.Option(help="Factor on the bending in the scene; default: that of docs/airframe.md.")
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(help="Topic to export, can be repeated; default: all topics with one message per step."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="What to write; default: in the bag's folder, named after the format.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Write the topics of a bag as tables with field names and units (SI) in the header, or add a 3-D scene to the bag.

    Example: hsv export bags/case1_20260101T000000Z --csv --topic /hsv/state
    """
    from hsv.bags import export as tables
    from hsv.bags.description import TOPICS
    from hsv.bags.reader import Bag
    from hsv.base.errors import ParameterError

    chosen = [form for form, wanted in zip(tables.Format, (csv, parquet, npz), strict=True) if wanted]
    if len(chosen) + scene != 1:
        raise ParameterError("format: expected one of --csv, --parquet, --npz and --scene")
    opened = Bag(bag)
    if scene:
        if topic:
            raise ParameterError("topic: expected with a table, --scene holds every topic")
        from hsv.bags.scene import scene_path, write_scene
        from hsv.model.airframe.geometry import airframe

        most = airframe().largest_exaggeration
        if exaggeration is not None and not 0.0 <= exaggeration <= most:
            raise ParameterError(f"exaggeration = {exaggeration:g}: expected a number from 0 to {most:g}")
        out = out or scene_path(opened)
        write_scene(opened, out, exaggeration)
        print_written([out], json)
        print_bag_warnings(opened)
        return
    if exaggeration is not None:
        raise ParameterError("exaggeration: expected with --scene, tables hold what was recorded")
    if out is None:
        home = opened.folder.absolute()
        # Not among the bags: bags/* stays a list of bags.
        out = home / (f"{home.name}.npz" if npz else str(chosen[0]))
    topics = topic or [name for name in TOPICS if name in opened.roles]
    print_written(tables.export(opened, topics, chosen[0], out), json)
    print_bag_warnings(opened)

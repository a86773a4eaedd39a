"""The command ``hsv play``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.bag_warnings import print_bag_warnings
from hsv.cli.options import BagArgument


def play(
    bag: BagArgument,
    rate: Annotated[float, typer.Option(help="Pace: 1 is as recorded, 10 ten times as fast.")] = 1.0,
    topic: Annotated[list[str] | None, typer.Option(help="Topic to publish, can be repeated; default: all.")] = None,
    clock: Annotated[bool, typer.Option(help="Publish the clock.")] = True,
    paused: Annotated[
        bool, typer.Option("--paused", help="Start paused; continue with the services /player/step and /player/resume.")
    ] = False,
    namespace: Annotated[str, typer.Option(help="ROS namespace to publish in; default: that of the bag.")] = "",
    delay: Annotated[float, typer.Option(help="Wall time (s) that subscribers get to discover the player.")] = 1.0,
) -> None:
    """Republish a bag over DDS, for a viewer or a node under test.

    Example: hsv play bags/case1_20260101T000000Z --rate 10 --topic /hsv/state
    """
    from hsv.bags.description import PLAYER
    from hsv.bags.reader import Bag
    from hsv.graph.launcher import become

    print_bag_warnings(Bag(bag))
    words = [str(bag), "--rate", str(rate), "--delay", str(delay)]
    if topic:
        words += ["--topics", *topic]
    if not clock:
        words.append("--no-clock")
    if paused:
        words.append("--paused")
    become(PLAYER, words, namespace)

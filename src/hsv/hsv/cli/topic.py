"""The command ``hsv topic``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import GraphNamespaceOption, JsonOption


def topic(
    name: Annotated[str, typer.Argument(help="Topic, e.g. /hsv/state; default: list the topics.")] = "",
    once: Annotated[bool, typer.Option("--once", help="Print one message only.")] = False,
    every: Annotated[int, typer.Option(min=1, help="Print every N-th message.")] = 1,
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Print the messages of a topic of a running graph, with units, until its publisher is gone.

    Without a topic: list the topics with their types, publishers and subscribers. With --json: one object per line.

    Example: hsv topic /hsv/state --every 50
    """
    from hsv.bags.description import TOPIC
    from hsv.base.errors import ParameterError
    from hsv.graph.launcher import become

    if not name and (once or every > 1):
        option = "once" if once else f"every = {every}"
        raise ParameterError(f"{option}: expected with a topic only")
    flags = [f"--{flag}" for flag, given in (("once", once), ("json", json)) if given]
    become(TOPIC, ["--prog", "hsv topic", *flags, "--every", str(every), *(["--", name] if name else [])], namespace)

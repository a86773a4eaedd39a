"""The command ``hsv watch``."""

from __future__ import annotations

from hsv.cli.options import GraphNamespaceOption, JsonOption, UnitsOption
from hsv.units import UnitSystem


def watch(
    namespace: GraphNamespaceOption = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Show where the flight of a running graph is, whoever has started it: a line that moves, until it ends.

    Nobody in the graph waits for it. With --json, or into a file: a line for each look, five a second at most.

    Example: hsv watch --units paper
    """
    from hsv.graph.description import WATCH
    from hsv.graph.launcher import become

    flags = ["--json"] if json else []
    become(WATCH, ["--prog", "hsv watch", "--units", units, *flags], namespace)

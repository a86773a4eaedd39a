"""The command ``hsv watch``."""

from __future__ import annotations

from hsv.base.units import UnitSystem
from hsv.cli.options import GraphNamespaceOption, JsonOption, UnitsOption


def watch(
    namespace: GraphNamespaceOption = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Show the current state of a running flight, no matter how it was started, on a line that is updated.

    The graph never waits for this command. With --json, or into a file, at most five lines per second are printed.

    Example: hsv watch --units paper
    """
    from hsv.bags.description import WATCH
    from hsv.graph.launcher import become

    flags = ["--json"] if json else []
    become(WATCH, ["--prog", "hsv watch", "--units", units, *flags], namespace)

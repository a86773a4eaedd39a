"""The command ``hsv set``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.cli.options import GraphNamespaceOption, JsonOption


def set(
    name: Annotated[str, typer.Argument(help="Parameter that may change in flight: tau (feedback.tau).")],
    value: Annotated[str, typer.Argument(help="Its value, with a unit where it has one: 0.8, or 0.8,0.8,0.9,0.9,1.")],
    namespace: GraphNamespaceOption = "",
    json: JsonOption = False,
) -> None:
    """Change a parameter of a running flight at the next step that is not flown yet.

    Example: hsv set tau 0.8
    """
    from hsv.bags.description import SET_PARAMETER
    from hsv.graph.launcher import become

    become(SET_PARAMETER, ["--prog", "hsv set", *(["--json"] if json else []), "--", name, value], namespace)

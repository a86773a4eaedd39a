"""Parameters that may change in flight: whose they are, and their values as people write them."""

from __future__ import annotations

import re

from hsv.bags.description import NodeDescription, graph
from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter
from hsv.base.units import parse_quantity
from hsv.graph.node_parameters import NODE_PARAMETERS

SETTABLE: dict[str, tuple[NodeDescription, Parameter]] = {
    parameter.name: (node, parameter)
    for node in graph()
    for parameter in NODE_PARAMETERS[node.name]
    if not parameter.read_only
}
"""Parameters that may change in flight, by name, with the node that has them."""

_STEP = re.compile(r"from step (\d+) on")

_TRUTH = {"true": True, "false": False}


def find(name: str) -> tuple[NodeDescription, Parameter]:
    """Return the node and the parameter that a full name, or the last word of one, means.

    Raises:
        ParameterError: None that may change in flight.
    """
    found = [entry for full, entry in SETTABLE.items() if name in (full, full.rpartition(".")[2])]
    if len(found) != 1:
        raise ParameterError(f"name = {name!r}: expected a parameter that may change in flight, {', '.join(SETTABLE)}")
    return found[0]


def parse(text: str, parameter: Parameter) -> bool | float | list[float]:
    """Return the value in ``text``: numbers with their units between commas, in brackets or not; true or false.

    Raises:
        QuantityError, ParameterError: It is none that the parameter takes.
    """
    if parameter.kind == "bool":
        return bool(parameter.check(_TRUTH.get(text.strip().lower(), text)))
    words = text.strip().removeprefix("[").removesuffix("]").split(",")
    values = [parse_quantity(word, parameter.unit or "1", parameter.name) for word in words]
    if parameter.kind == "double":
        return float(parameter.check(values[0] if len(values) == 1 else values))
    return list(parameter.check(values))


def step_in(answer: str) -> int:
    """Return the step at which a change takes effect, from the reply of a node."""
    step = _STEP.search(answer)
    assert step, "a parameter that may change in flight answers from which step on"
    return int(step[1])

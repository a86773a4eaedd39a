"""Parameters of all nodes of a graph, in the form of a ROS 2 parameter file: what they share, and what is their own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import yaml

from hsv.control.design import DESIGN_PARAMETERS, TAU, parse_sections

_ALL = "/**"


@dataclass(frozen=True)
class ParameterSections:
    """Flat parameters by node."""

    shared: dict[str, Any]
    """Values for every node that has the parameter."""
    own: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Values by node, which override the shared ones."""

    @classmethod
    def gathered(cls, values: Mapping[str, Mapping[str, Any]]) -> Self:
        """Return the parameters of the nodes in ``values``; a value on which all nodes agree is shared."""
        differing = differences(values)
        shared = {name: value for flat in values.values() for name, value in flat.items() if name not in differing}
        own = {node: {name: flat[name] for name in differing if name in flat} for node, flat in values.items()}
        return cls(shared, {node: flat for node, flat in own.items() if flat})

    @classmethod
    def parse(cls, text: str, source: str) -> Self:
        """Return the contents of the ``text`` of a parameter file.

        Raises:
            DesignError: It is no parameter YAML; the message names ``source``.
        """
        sections = parse_sections(text, source)
        shared = sections.pop(_ALL, {})
        return cls(shared, {name.removeprefix("/"): flat for name, flat in sections.items()})

    def of(self, node: str) -> dict[str, Any]:
        """Return the flat parameters of a node; those of other nodes may be among them."""
        return self.shared | self.own.get(node, {})

    def only(self, names: Iterable[str]) -> Self:
        """Return the parameters of these names."""
        kept = set(names)
        shared = {name: value for name, value in self.shared.items() if name in kept}
        own = {node: {n: v for n, v in flat.items() if n in kept} for node, flat in self.own.items()}
        return type(self)(shared, {node: flat for node, flat in own.items() if flat})

    @property
    def names(self) -> set[str]:
        """Names of all parameters."""
        return set(self.shared).union(*self.own.values())

    def updated(self, values: Mapping[str, Any]) -> Self:
        """Return the parameters with these in place, for every node."""
        own = {node: {n: v for n, v in flat.items() if n not in values} for node, flat in self.own.items()}
        return type(self)(self.shared | dict(values), own)

    def overlaid(self, other: ParameterSections) -> Self:
        """Return the parameters with those of ``other`` over them, as of two files given one after the other."""
        below = self.updated(other.shared)
        nodes = below.own.keys() | other.own.keys()
        return type(self)(below.shared, {n: below.own.get(n, {}) | other.own.get(n, {}) for n in nodes})

    def to_yaml(self) -> str:
        """Return the text of a ROS 2 parameter file."""
        sections = {_ALL: self.shared} | {f"/{node}": flat for node, flat in sorted(self.own.items())}
        # Dotted names need no nesting: rcl takes them as they are.
        tree = {name: {"ros__parameters": flat} for name, flat in sections.items() if flat}
        return yaml.safe_dump(tree, sort_keys=False)


def differences(values: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the parameters that nodes have with different values, each with its value by node."""
    by_name: dict[str, dict[str, Any]] = {}
    for node, flat in values.items():
        for name, value in flat.items():
            by_name.setdefault(name, {})[node] = value
    return {
        name: having
        for name, having in by_name.items()
        if any(v != next(iter(having.values())) for v in having.values())
    }


def disagreements(values: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say which parameters nodes of one graph have with different values although they need the same.

    Not ``feedback.tau``, which the controller alone flies with. Of two designs, their digests say enough.
    """
    differing = differences(values)
    differing.pop(TAU.name, None)
    if "design.hash" in differing:
        for parameter in DESIGN_PARAMETERS:
            if parameter.name not in ("design.hash", "period"):
                differing.pop(parameter.name, None)
    return [
        f"parameter {name} differs: " + ", ".join(f"{_short(value)} in {node}" for node, value in having.items())
        for name, having in differing.items()
    ]


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 24 else text[:21] + "..."

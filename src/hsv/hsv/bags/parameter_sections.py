"""Parameters of all nodes of a graph as in a ROS 2 parameter file: shared values, and values of single nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import yaml

from hsv.control.design import DESIGN_PARAMETERS, TAU
from hsv.control.design_file import parse_sections

_ALL = "/**"


@dataclass(frozen=True)
class ParameterSections:
    """Parameters of the nodes of a graph by their full, dotted names: shared ones, and those of single nodes."""

    shared: dict[str, Any]
    """Values for every node that has the parameter."""
    own: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Values of single nodes, which override the shared ones."""

    @classmethod
    def gathered(cls, values: Mapping[str, Mapping[str, Any]]) -> Self:
        """Return the parameters in ``values``, {node: {name: value}}; those equal in all their nodes are shared."""
        differing = differences(values)
        shared = {name: value for flat in values.values() for name, value in flat.items() if name not in differing}
        own = {node: {name: flat[name] for name in differing if name in flat} for node, flat in values.items()}
        return cls(shared, {node: flat for node, flat in own.items() if flat})

    @classmethod
    def parse(cls, text: str, source: str) -> Self:
        """Return the parameters in the ``text`` of a parameter file; a DesignError names its ``source``."""
        sections = parse_sections(text, source)
        shared = sections.pop(_ALL, {})
        return cls(shared, {name.removeprefix("/"): flat for name, flat in sections.items()})

    def of(self, node: str) -> dict[str, Any]:
        """Return the values for a node by name: all shared ones, even of parameters it lacks, overridden by its own."""
        return self.shared | self.own.get(node, {})

    def only(self, names: Iterable[str]) -> Self:
        """Return the parameters with these ``names`` only."""
        kept = set(names)
        shared = {name: value for name, value in self.shared.items() if name in kept}
        own = {node: {n: v for n, v in flat.items() if n in kept} for node, flat in self.own.items()}
        return type(self)(shared, {node: flat for node, flat in own.items() if flat})

    @property
    def names(self) -> set[str]:
        """Names of all parameters."""
        return set(self.shared).union(*self.own.values())

    def updated(self, values: Mapping[str, Any]) -> Self:
        """Return the parameters with ``values`` (by name) set for every node."""
        own = {node: {n: v for n, v in flat.items() if n not in values} for node, flat in self.own.items()}
        return type(self)(self.shared | dict(values), own)

    def overlaid(self, other: ParameterSections) -> Self:
        """Return both sets of parameters merged; ``other`` overrides, like the later one of two parameter files."""
        below = self.updated(other.shared)
        nodes = below.own.keys() | other.own.keys()
        return type(self)(below.shared, {n: below.own.get(n, {}) | other.own.get(n, {}) for n in nodes})

    def to_yaml(self) -> str:
        """Return the text of a ROS 2 parameter file."""
        sections = {_ALL: self.shared} | {f"/{node}": flat for node, flat in sorted(self.own.items())}
        # rcl accepts dotted names without nesting.
        tree = {name: {"ros__parameters": flat} for name, flat in sections.items() if flat}
        return yaml.safe_dump(tree, sort_keys=False)


def differences(values: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the parameters that differ between nodes as {name: {node: value}}; ``values`` is {node: {name: value}}."""
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
    """Return a message for each parameter that must be equal in all nodes of a graph and is not.

    ``feedback.tau`` may differ, because only the controller uses it. If ``design.hash`` differs, so do the designs; of
    their parameters, only it and ``period`` are then reported.
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

"""Command-line arguments that rclpy does not expose: the parameters given for several nodes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from hsv.bags.description import checked_namespace
from hsv.base.errors import ParameterError
from hsv.base.files import parse_yaml, read_text

_PARAMETERS = "ros__parameters"


def shared_parameters(words: Sequence[str], several: bool) -> frozenset[str]:
    """Return the names of the parameters in the arguments of a process that apply to more than one node.

    These are those in a section for every node, such as ``/**``, of a parameter file, and, in a process of ``several``
    nodes, those that are given with ``-p``. ROS has taken the arguments before: what it refuses is not looked at.
    """
    names: set[str] = set()
    for flag, value in pairwise(_ros_arguments(words)):
        if flag == "--params-file":
            content = parse_yaml(read_text(Path(value)))
            names.update(_of_all_nodes(content if isinstance(content, Mapping) else {}))
        elif several and flag in ("-p", "--param"):
            names.add(value.partition(":=")[0])
    return frozenset(names)


def check_names(words: Sequence[str], several: bool) -> None:
    """Check the node names in the arguments of a process, because ROS reports errors in them in several lines.

    Args:
        words: The arguments.
        several: Whether the process has several nodes, which one name would make indistinguishable.
    """
    for flag, rule in pairwise(_ros_arguments(words)):
        if flag not in ("-r", "--remap"):
            continue
        left, _, name = rule.partition(":=")
        node, _, kind = left.rpartition(":")
        if kind == "__ns":
            if not name.startswith("/"):
                raise ParameterError(f"{rule}: expected a namespace with a leading slash, such as /veh1")
            checked_namespace(name)
        elif kind in ("__node", "__name"):
            if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
                raise ParameterError(f"{rule}: expected a name of letters, digits and underscores, no digit first")
            if several and not node:
                raise ParameterError(f"{rule}: all nodes of this process would have one name, expected NODE:{rule}")


def _ros_arguments(words: Sequence[str]) -> Iterator[str]:
    inside = False
    for word in words:
        if word == "--ros-args":
            inside = True
        elif word == "--":
            inside = False
        elif inside:
            yield word


def _of_all_nodes(content: Mapping[str, Any], wildcard: bool = False) -> Iterator[str]:
    """Yield the names in the sections of a parameter file whose node has a wildcard in its name."""
    for name, value in content.items():
        if not isinstance(value, Mapping):
            continue
        if name == _PARAMETERS:
            yield from _flattened(value) if wildcard else ()
        else:
            yield from _of_all_nodes(value, wildcard or "*" in str(name))


def _flattened(tree: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"

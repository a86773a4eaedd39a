"""Files of controller designs: found by name, read from and written to ROS 2 parameter YAML."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from hsv.base.documents import parse_yaml, read_text
from hsv.base.errors import DesignError, DocumentError, did_you_mean
from hsv.control.design import ControlDesign
from hsv.control.design_parameters import DESIGN_PARAMETERS

_SHIPPED = Path(__file__).parents[1] / "designs"
"""In a checkout a link to ``offline_design``, in an installed package a folder of its own."""

_DESIGN_NAMES = [parameter.name for parameter in DESIGN_PARAMETERS]


def write_design(path: Path, design: ControlDesign, comment: str) -> None:
    """Write ``design`` as ROS 2 parameter YAML for all nodes, with ``comment`` lines on top."""
    tree: dict[str, Any] = {}
    for name, value in design.to_parameters().items():
        *groups, leaf = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
        branch[leaf] = value
    header = "".join(f"# {line}\n" for line in comment.splitlines())
    body = yaml.dump({"/**": {"ros__parameters": tree}}, sort_keys=False, default_flow_style=None, width=120)
    path.write_text(header + body, encoding="utf-8")


def read_parameters(path: Path, node: str = "") -> dict[str, Any]:
    """Return the flat parameters for ``node`` in a ROS 2 parameter YAML: its own section over the one for all nodes.

    Raises:
        DesignError: The file is missing or is not parameter YAML.
    """
    try:
        text = read_text(path)
    except DocumentError as error:
        raise DesignError(f"design {str(path)!r}: {error}, expected a parameter file") from error
    return parse_parameters(text, str(path), node)


def parse_parameters(text: str, source: str, node: str = "") -> dict[str, Any]:
    """Return the flat parameters in the ``text`` of a parameter YAML, as :func:`read_parameters`.

    Raises:
        DesignError: The text is not parameter YAML; the message names ``source``.
    """
    sections = parse_sections(text, source)
    flat: dict[str, Any] = {}
    for section in ("/**", node, f"/{node}"):
        flat |= sections.get(section, {})
    if not flat:
        raise _no_parameters(source)
    return flat


def parse_sections(text: str, source: str) -> dict[str, dict[str, Any]]:
    """Return the flat parameters of every section in the ``text`` of a parameter YAML, ``"/**"`` for all nodes.

    Raises:
        DesignError: See :func:`parse_parameters`.
    """
    try:
        tree = parse_yaml(text)
    except DocumentError as error:
        raise DesignError(f"design {source!r}: {error}, expected ROS 2 parameters in YAML") from error
    sections: dict[str, dict[str, Any]] = {}
    for section, branch in tree.items() if isinstance(tree, dict) else ():
        if isinstance(branch, dict) and isinstance(branch.get("ros__parameters"), dict):
            flat = sections.setdefault(str(section), {})
            for name, value in _flattened(branch["ros__parameters"], ""):
                if name in flat:
                    raise DesignError(f"design {source!r}: parameter {name} occurs twice, expected once")
                flat[name] = value
    if not any(sections.values()):
        raise _no_parameters(source)
    return sections


def _no_parameters(source: str) -> DesignError:
    return DesignError(f"design {source!r}: expected ROS 2 parameters ('/**': 'ros__parameters': ...)")


def read_design(path: Path) -> ControlDesign:
    """Return the design in a parameter file; errors name the file and the parameter (see :class:`ControlDesign`)."""
    values = read_parameters(path)
    try:
        for name in values:
            if name not in _DESIGN_NAMES:
                raise DesignError(
                    f"parameter {name}: unknown, expected those of a design{did_you_mean(name, _DESIGN_NAMES)}"
                )
        return ControlDesign.from_parameters(values)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error


def find_design(name: str) -> Path:
    """Return the parameter file of a design given by path, or by name: in ``HSV_DESIGN_PATH``, or a shipped one.

    Raises:
        DesignError: No such file.
    """
    return find_file(name, ".yaml")


def find_file(name: str, suffix: str) -> Path:
    """Return a design's file of the given ``suffix``; see :func:`find_design`."""
    if "/" in name or name.endswith(suffix):
        candidates = [Path(name)]
    else:
        folders = [Path(folder) for folder in os.environ.get("HSV_DESIGN_PATH", "").split(os.pathsep) if folder]
        candidates = [folder / f"{name}{suffix}" for folder in (*folders, _SHIPPED.resolve())]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise DesignError(
        f"design = {name!r}: no such file, expected the path of a {suffix} file, a name in HSV_DESIGN_PATH or of a "
        "shipped one"
    )


def _flattened(branch: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in branch.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value

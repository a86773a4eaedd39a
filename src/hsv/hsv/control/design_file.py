"""The files of a design: its ROS 2 parameter file, where it is found by name, and its certificate next to it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from hsv.base.errors import DesignError, DocumentError, did_you_mean
from hsv.base.files import parse_json, parse_yaml, read_text
from hsv.base.parameters import Parameter
from hsv.control.design import DESIGN_PARAMETERS, ControlDesign

_SHIPPED = Path(__file__).parents[1] / "designs"
"""Folder of the shipped designs: a link to ``offline_design`` in a checkout, a copy in an installed package."""

FORMAT = 2
"""Version of the fields of a certificate."""

_NAMES = [parameter.name for parameter in DESIGN_PARAMETERS]


def write_design(path: Path, design: ControlDesign, comment: str) -> None:
    """Write ``design`` to ``path`` as ROS 2 parameter YAML for all nodes, with the lines of ``comment`` at the top."""
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


def read_parameters(path: Path) -> dict[str, Any]:
    """Return the flat parameters that the ROS 2 parameter file at ``path`` sets for all nodes, in section ``/**``.

    Raises:
        DesignError: The file cannot be read, or :func:`parse_parameters` refuses it.
    """
    return parse_parameters(_text(path), str(path))


def _text(path: Path) -> str:
    try:
        return read_text(path)
    except DocumentError as error:
        raise DesignError(f"design {str(path)!r}: {error}, expected a parameter file") from error


def parse_parameters(text: str, source: str) -> dict[str, Any]:
    """Return the flat parameters for all nodes in the ``text`` of a ROS 2 parameter file.

    Raises:
        DesignError: There are no such parameters, or :func:`parse_sections` fails; the message names ``source``.
    """
    if flat := parse_sections(text, source).get("/**"):
        return flat
    raise _no_parameters(source)


def parse_sections(text: str, source: str) -> dict[str, dict[str, Any]]:
    """Return the flat parameters in the ``text`` of a ROS 2 parameter file, by section; ``"/**"`` is for all nodes.

    Raises:
        DesignError: It is not YAML, has no parameters or one of them twice; the message names ``source``.
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
    """Return the design in the parameter file at ``path``; a DesignError names the file and the wrong parameter."""
    return _design_in(_text(path), str(path))


@lru_cache(maxsize=4)
def _design_in(text: str, source: str) -> ControlDesign:
    """Return the design in a ``text``; the last ones are kept, because reading takes longer than a flight."""
    values = parse_parameters(text, source)
    try:
        for name in values:
            if name not in _NAMES:
                raise DesignError(f"parameter {name}: unknown, expected those of a design{did_you_mean(name, _NAMES)}")
        return ControlDesign.from_parameters(values)
    except DesignError as error:
        raise DesignError(f"{source}: {error}") from error


def find_design(name: str) -> Path:
    """Return the path of a design's parameter file, given as a path (with ``/`` or ending in ``.yaml``) or as a name.

    A name is looked up in the folders of the environment variable ``HSV_DESIGN_PATH``, then among the shipped designs.

    Raises:
        DesignError: There is no such file.
    """
    return find_file(name, ".yaml")


def find_file(name: str, suffix: str) -> Path:
    """Return the path of a design's file with this ``suffix``; look-up and error are those of :func:`find_design`."""
    named = "/" in name or name.endswith(suffix)
    candidates = [Path(name)] if named else [folder / f"{name}{suffix}" for folder in _folders()]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    names = {path.stem for candidate in candidates for path in candidate.parent.glob(f"*{suffix}")}
    raise DesignError(
        f"design = {name!r}: no such file, expected the path of a {suffix} file, a name in HSV_DESIGN_PATH or of a "
        f"shipped one{did_you_mean(Path(name).stem, names)}"
    )


def design_names() -> list[str]:
    """Return the names of the designs with a certificate in ``HSV_DESIGN_PATH`` and among the shipped ones."""
    return sorted({path.stem for folder in _folders() for path in folder.glob("*.yaml") if find_certificate(str(path))})


def _folders() -> list[Path]:
    own = os.environ.get("HSV_DESIGN_PATH", "").split(os.pathsep)
    return [*(Path(folder) for folder in own if folder), _SHIPPED.resolve()]


def _flattened(branch: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for name, value in branch.items():
        if isinstance(value, dict):
            yield from _flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


CERTIFICATE_PARAMETERS = (
    Parameter("design.certificate", "", "certificate for checking the design; empty: that of the design with its name"),
)
"""Parameters of the node that checks the design before a flight."""


def certificate_path(design_file: Path) -> Path:
    """Return the path of the certificate for a parameter file: ``baseline.certificate.json`` for ``baseline.yaml``."""
    return design_file.with_suffix(".certificate.json")


def find_certificate(design: str, named: str = "") -> Path | None:
    """Return the path of the certificate of a design, or None if there is none.

    Args:
        design: Name of the design, or path of its parameter file; the certificate lies next to this file.
        named: Path of a certificate to return instead, whether or not there is such a file; empty: none.
    """
    if named:
        return Path(named)
    try:
        path = certificate_path(find_design(design))
    except DesignError:
        return None
    return path if path.is_file() else None


def write_certificate(path: Path, report: dict[str, Any]) -> None:
    """Write the ``report`` on a design as its certificate; the same report gives the same bytes."""
    path.write_text(json.dumps(report, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_certificate(path: Path) -> dict[str, Any]:
    """Return the contents of a certificate.

    Raises:
        DesignError: The file is missing, or :func:`parse_certificate` refuses it.
    """
    try:
        text = read_text(path)
    except DocumentError as error:
        raise DesignError(f"{path}: {error}, expected a design certificate in JSON") from error
    return parse_certificate(text, str(path))


def parse_certificate(text: str | bytes, source: str) -> dict[str, Any]:
    """Return the contents of a certificate from its JSON ``text``.

    Raises:
        DesignError: It is not a certificate of this format; the message names ``source``.
    """
    try:
        report = parse_json(text)
    except DocumentError as error:
        raise DesignError(f"{source}: {error}, expected a design certificate in JSON") from error
    if not isinstance(report, dict) or not {"inputs", "feedback", "nominal", "tube"} <= report.keys():
        raise DesignError(f"{source}: expected a design certificate with inputs, feedback, nominal and tube")
    if (found := report.get("format", 1)) != FORMAT:
        raise DesignError(
            f"{source}: format = {found!r}: expected {FORMAT}; compute the design again with hsv design NAME --force"
        )
    return report


def design_files(design: Path) -> dict[str, str]:
    """Return the texts of a ``design`` file and, if any, its certificate, by their attachment names in a bag."""
    return {"design.yaml": read_text(design)} | attached_certificate(certificate_path(design))


def attached_certificate(path: Path | None) -> dict[str, str]:
    """Return the text of the certificate by its attachment name in a bag; empty if there is no such file."""
    return {"certificate.json": read_text(path)} if path and path.is_file() else {}

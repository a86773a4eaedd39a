"""The certificate beside a design file: everything that a stranger needs to recompute it, as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hsv.base.documents import parse_json, read_text
from hsv.base.errors import DesignError, DocumentError
from hsv.base.parameters import Parameter
from hsv.control.design_file import find_design

CERTIFICATE_PARAMETERS = (
    Parameter("design.certificate", "", "certificate for checking the design; empty: that of the design with its name"),
)
"""Parameters of the node that checks the design before a flight."""


def certificate_path(design_file: Path) -> Path:
    """Return where the certificate of a parameter file lies: ``baseline.yaml`` has ``baseline.certificate.json``."""
    return design_file.with_suffix(".certificate.json")


def find_certificate(design: str, named: str = "") -> Path | None:
    """Return the certificate ``named``, by default the one of the design's own file; None if there is none.

    Args:
        design: Name of the design, or path of its parameter file.
        named: Path of a certificate; not looked for.
    """
    if named:
        return Path(named)
    try:
        path = certificate_path(find_design(design))
    except DesignError:
        return None
    return path if path.is_file() else None


def write_certificate(path: Path, report: dict[str, Any]) -> None:
    """Write the report of a design; the same report gives the same bytes."""
    path.write_text(json.dumps(report, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_certificate(path: Path) -> dict[str, Any]:
    """Return the report of a design.

    Raises:
        DesignError: The file is missing or is not a certificate.
    """
    try:
        report = parse_json(read_text(path))
    except DocumentError as error:
        raise DesignError(f"{path}: {error}, expected a design certificate in JSON") from error
    if not isinstance(report, dict) or not {"inputs", "feedback", "nominal", "tube"} <= report.keys():
        raise DesignError(f"{path}: expected a design certificate with inputs, feedback, nominal and tube")
    return report


def design_files(design: Path) -> dict[str, str]:
    """Return the attachments of a bag that belong to its design, by name: parameters and certificate."""
    return {"design.yaml": read_text(design)} | attached_certificate(certificate_path(design))


def attached_certificate(path: Path | None) -> dict[str, str]:
    """Return the attachment of a bag that is the certificate, by name; none without one."""
    return {"certificate.json": read_text(path)} if path and path.is_file() else {}

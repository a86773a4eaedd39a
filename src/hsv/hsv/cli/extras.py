"""Libraries that some commands alone need, and the extras of the package that bring them."""

from __future__ import annotations

EXTRAS = {
    "clarabel": "design",
    "cvxpy": "design",
    "distributed": "campaign",
    "foxglove": "live",
    "jinja2": "report",
    "markupsafe": "report",
    "matplotlib": "report",
    "pyarrow": "campaign",
    "websockets": "live",
}
"""By imported module: the extra of setup.py that has its distribution."""


def missing_extra(error: ImportError) -> str | None:
    """Return the extra that brings the module which ``error`` says is not installed; None where none does."""
    return EXTRAS.get((error.name or "").partition(".")[0]) if isinstance(error, ModuleNotFoundError) else None

"""The fingerprint of a flight: a digest of all bits of its states, inputs and commands, the same on every machine.

Other digests identify stored results. They cover everything on which the outcome of a flight depends.

A table of published fingerprints is part of the library. It shows whether a flight of a shipped scenario with its
shipped design is the published one. The table has no scenario whose nominal law calls a solver in flight, because the
result of a solver depends on the machine, within a tolerance.
"""

from __future__ import annotations

import hashlib
import shutil
import tomllib
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:  # a node, which computes no fingerprint, does not load the scenario's tables
    from hsv.flight.scenario import Scenario

FORMAT = 1
"""Version of the contents and the order of the digested data."""

TABLE = "fingerprints.toml"

_ROWS = 2000

_FLOWN = ("base", "core", "model", "control", "flight")
"""Packages with the code and the vehicle tables that a flight uses."""

DIGITS = 12
"""Number of digits of a digest in the name of a file or folder, enough to avoid collisions."""


def fingerprint(flown: np.ndarray) -> str:
    """Return ``v1:`` and the hexadecimal SHA-256 of the rows of ``flown``, shape (n + 1, 25).

    Row k has 25 numbers of step k: x (9 numbers), q_f, x_n (9), u_n (2), command u (2) and actuator input (2). They are
    digested row after row as little-endian float64, with all NaNs replaced by the same NaN.
    """
    digest = hashlib.sha256()
    # As many rows at a time as the processor's cache holds.
    for start in range(0, len(flown), _ROWS):
        rows = np.ascontiguousarray(flown[start : start + _ROWS], "<f8")
        if (unknown := np.isnan(rows)).any():
            rows = np.where(unknown, np.nan, rows)
        digest.update(rows.data)
    return f"v{FORMAT}:{digest.hexdigest()}"


def as_published(found: str | None, scenario: Scenario | None, design_hash: str) -> bool | None:
    """Return True if ``found``, the fingerprint of a flight, is published, for whichever scenario; else False or None.

    False: another fingerprint is published for ``scenario``, as shipped, with the design of digest ``design_hash``.
    None: no fingerprint is published for the two, the scenario was changed or is None, or the flight has none.
    """
    if any(found == entry["fingerprint"] for entry in _table().values()):
        return True
    entry = _table().get(scenario.name) if scenario else None
    if found is None or scenario is None or entry is None or entry["design_hash"] != design_hash:
        return None
    from hsv.flight.scenario import load_scenario

    if load_scenario(scenario.name).parameters() != scenario.parameters():
        return None
    return False


def published_in_words(found: str | None, same: bool | None) -> str:
    """Return ``same``, the result of :func:`as_published` for the fingerprint ``found``, as text."""
    if found is None:
        return "none: the recording is not complete"
    return {True: "as published", False: "not the published flight of this scenario", None: "none is published"}[same]


def published_fingerprint(name: str) -> str | None:
    """Return the published fingerprint of the shipped scenario ``name``, None if there is none."""
    entry = _table().get(name)
    return entry["fingerprint"] if entry else None


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads(files("hsv.flight").joinpath(TABLE).read_text(encoding="utf-8"))


@cache
def code_digest() -> str:
    """Return the digest of the code and the vehicle tables that a flight uses."""
    found = [path for name in _FLOWN for path in Path(str(files("hsv")), name).rglob("*")]
    return digest_of(path.read_bytes() for path in sorted(found) if path.suffix in (".py", ".toml", ".c", ".h"))


def drop_older(path: Path) -> None:
    """Remove outdated files and folders, whose names differ from that of ``path`` in the digest alone."""
    name, _, rest = path.name.rpartition("_")
    for other in path.parent.glob(f"{name}_{'[0-9a-f]' * DIGITS}{rest[DIGITS:]}"):
        if other != path:
            shutil.rmtree(other) if other.is_dir() else other.unlink()


def digest_of(parts: Iterable[bytes]) -> str:
    """Return the hexadecimal SHA-256 of the SHA-256 digests of all ``parts``."""
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()

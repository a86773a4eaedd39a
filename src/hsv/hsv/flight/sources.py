"""Digests of everything on which the outcome of a flight depends; they identify stored results."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path

_FLOWN = ("base", "core", "model", "control", "flight")
"""Packages with the code and the vehicle tables that a flight uses."""

DIGITS = 12
"""Digits of a digest in the name of a folder, enough to avoid collisions."""


@cache
def package_digest(*names: str) -> str:
    """Return the digest of code and tables in the packages ``names`` of ``hsv``, including their subpackages."""
    root = Path(str(files("hsv")))
    paths = [
        path for name in names for path in root.joinpath(name).rglob("*") if path.suffix in (".py", ".toml", ".c", ".h")
    ]
    return digest_of(path.read_bytes() for path in sorted(paths))


@cache
def code_digest() -> str:
    """Return the digest of the code and the vehicle tables that a flight uses."""
    return package_digest(*_FLOWN)


def drop_older(path: Path) -> None:
    """Remove outdated files, which have the name of ``path`` with another digest."""
    name, _, rest = path.name.rpartition("_")
    for other in path.parent.glob(f"{name}_{'[0-9a-f]' * DIGITS}{rest[DIGITS:]}"):
        if other != path:
            shutil.rmtree(other) if other.is_dir() else other.unlink()


def digest_of(parts: Iterable[bytes]) -> str:
    """Return one digest (SHA-256) for several contents."""
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()

"""Paths in the checkout, and digests of their contents."""

from __future__ import annotations

import hashlib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
VENV = ROOT / ".venv"
WORKSPACE = ROOT / "ros_ws"
BUILD, INSTALL, LOG = WORKSPACE / "build", WORKSPACE / "install", WORKSPACE / "log"
STAMPS = VENV / "hsv-setup"
"""Digests for which each stage was last completed; env.sh reads "environment" here."""


def fingerprint(*parts: str | bytes) -> str:
    """Return a hash of the parts, in order and with their boundaries."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little") + data)
    return digest.hexdigest()


def read_stamp(path: Path) -> str:
    """Return what a stamp file says, or nothing when there is none."""
    return path.read_text() if path.is_file() else ""


def write_stamp(path: Path, key: str) -> None:
    """Record that a stage is complete for `key`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(key)

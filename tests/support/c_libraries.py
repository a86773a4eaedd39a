"""Shared libraries of controllers in C, built for the tests with the header that is installed."""

from __future__ import annotations

import subprocess
from pathlib import Path

from hsv.control.c_block import include_folder

PROBE = Path(__file__).with_name("probe.c")
FLAGS = (
    "-std=c99",
    "-D_POSIX_C_SOURCE=199309L",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-O2",
    "-ffp-contract=off",
)


def build_probe(folder: Path, *flags: str, name: str = "probe") -> Path:
    """Build ``probe.c`` with more flags into a folder; return the library."""
    library = folder / f"{name}.so"
    command = ["cc", *FLAGS, *flags, f"-I{include_folder()}", "-shared", "-fPIC", "-o", library, PROBE]
    subprocess.run(command, check=True)
    return library

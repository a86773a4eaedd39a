"""The build of the core: its compiler, its options, and the one line where no compiler is installed."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PACKAGE = Path(__file__).parents[2] / "src" / "hsv"
BUILD = PACKAGE / "hsv" / "core" / "build.py"


def test_without_a_compiler_one_line_names_the_packages_to_install() -> None:
    command = [sys.executable, "setup.py", "--version"]
    ran = subprocess.run(command, cwd=PACKAGE, env=os.environ | {"CC": "absent"}, capture_output=True, text=True)
    needed = "hsv needs a C compiler and Python's header files: sudo apt-get install g++ python3-dev\n"
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", needed)


def extension(folder: Path) -> Any:
    """Return the extension as setuptools gets it; the generated source goes to ``folder``."""
    return runpy.run_path(str(BUILD))["ffibuilder"].distutils_extension(str(folder), verbose=False)


def test_options_of_the_environment_come_last(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HSV_CFLAGS", "-O0 -fsanitize=address")
    built = extension(tmp_path)
    assert built.extra_compile_args[-2:] == built.extra_link_args == ["-O0", "-fsanitize=address"]


def test_every_source_is_compiled_and_every_header_can_make_the_extension_outdated(tmp_path: Path) -> None:
    built = extension(tmp_path)
    assert {*map(Path, built.sources)} == {*BUILD.parent.glob("*.c"), tmp_path / "hsv/core/_core.c"}
    assert {*map(Path, built.depends)} == set(BUILD.parent.glob("*.h"))

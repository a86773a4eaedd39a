"""The build of the core: its compiler, its options, and the one line where no compiler is installed."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "src" / "hsv"
BUILD = PACKAGE / "hsv" / "core" / "build.py"


def test_without_a_compiler_one_line_names_the_packages_to_install() -> None:
    command = [sys.executable, "setup.py", "--version"]
    ran = subprocess.run(command, cwd=PACKAGE, env=os.environ | {"CC": "absent"}, capture_output=True, text=True)
    needed = "hsv needs a C compiler and Python's header files: sudo apt-get install g++ python3-dev\n"
    assert (ran.returncode, ran.stdout, ran.stderr) == (1, "", needed)


def test_options_of_the_environment_come_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HSV_CFLAGS", "-O0 -fsanitize=address")
    extension = runpy.run_path(str(BUILD))["ffibuilder"].distutils_extension(verbose=False)
    assert extension.extra_compile_args[-2:] == extension.extra_link_args == ["-O0", "-fsanitize=address"]


def test_an_edited_header_makes_the_extension_outdated() -> None:
    extension = runpy.run_path(str(BUILD))["ffibuilder"].distutils_extension(verbose=False)
    assert {Path(name) for name in extension.depends} == set(BUILD.parent.glob("*.h"))
    assert {*map(Path, extension.sources)} >= set(BUILD.parent.glob("*.c"))

"""Controllers in C, compiled for the tests with the installed header: shared libraries, and single functions."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from hsv.plugins.library import include_folder

PROBE = Path(__file__).with_name("probe.c")
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic")
FLAGS = ("-std=c99", "-D_POSIX_C_SOURCE=199309L", *WARNINGS, "-O2", "-ffp-contract=off")


def build_probe(folder: Path, *flags: str, name: str = "probe") -> Path:
    """Compile ``probe.c`` with additional flags into a folder and return the library."""
    library = folder / f"{name}.so"
    command = ["cc", *FLAGS, *flags, f"-I{include_folder()}", "-shared", "-fPIC", "-o", library, PROBE]
    subprocess.run(command, check=True)
    return library


@cache
def _step_functions() -> ctypes.CDLL:
    source = Path(__file__).with_name("step_functions.c")
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "step_functions.so")
        command = ["cc", *FLAGS, f"-I{include_folder()}", "-shared", "-fPIC", "-o", library, source]
        subprocess.run(command, check=True)
        return ctypes.CDLL(str(library))


def step_function(name: str) -> int:
    """Return the address, in this process, of a function of ``step_functions.c``."""
    address = ctypes.cast(getattr(_step_functions(), name), ctypes.c_void_p).value
    assert address is not None
    return address

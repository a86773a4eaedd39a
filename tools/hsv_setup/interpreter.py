"""Finding the Python that the virtual environment is made from."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass

from hsv_setup.paths import VENV

SUPPORTED = ((3, 11), (3, 12))
"""The versions that the constraints files hold for."""

# Asked of the interpreter itself: it may be another one than the one that runs this program.
_PROBE = """
import importlib.util, json, os, platform, sys, sysconfig
paths = sysconfig.get_paths()
print(json.dumps({
    "executable": os.path.realpath(getattr(sys, "_base_executable", sys.executable)),
    "version": list(sys.version_info[:3]),
    "machine": platform.machine(),
    "libc": list(platform.libc_ver()),
    "include": paths["include"],
    "has_headers": os.path.exists(os.path.join(paths["include"], "Python.h")),
    "has_venv": all(importlib.util.find_spec(name) for name in ("venv", "ensurepip")),
    "has_ros": all(importlib.util.find_spec(name) for name in ("rclpy", "colcon_core")),
}))
"""


@dataclass(frozen=True)
class Interpreter:
    """A Python interpreter, outside any virtual environment, and what it brings."""

    executable: str
    version: tuple[int, int, int]
    machine: str
    libc: tuple[str, str]
    include: str
    has_headers: bool
    has_venv: bool
    has_ros: bool
    """Whether it imports rclpy and colcon without any virtual environment."""

    @property
    def supported(self) -> bool:
        """Whether the constraints files hold for this version."""
        return self.version[:2] in SUPPORTED

    @property
    def version_text(self) -> str:
        """The version as people write it: "3.11.7"."""
        return ".".join(map(str, self.version))


def probe(command: str, env: Mapping[str, str]) -> Interpreter | None:
    """Return what `command` is, or None when it does not start as a Python interpreter."""
    try:
        result = subprocess.run(
            [command, "-c", _PROBE], env=dict(env), capture_output=True, text=True, timeout=300, check=False
        )
        found = json.loads(result.stdout)
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return None
    found["version"], found["libc"] = tuple(found["version"]), tuple(found["libc"])
    return Interpreter(**found)


def find(env: Mapping[str, str], with_ros: bool) -> Interpreter | None:
    """Return the interpreter to use: PYTHON if set, else the first suitable one, else any (to report on).

    An existing environment's own interpreter comes first, so that a changed PATH does not rebuild everything.
    """
    named = os.environ.get("PYTHON")
    if named:
        return probe(named, env)
    unsuitable = None
    for command in filter(None, [_existing(), "python3", "python3.12", "python3.11", "/usr/bin/python3"]):
        if shutil.which(command, path=env.get("PATH")) is None:
            continue
        found = probe(command, env)
        if found is not None and found.supported and (found.has_ros or not with_ros):
            return found
        unsuitable = unsuitable or found
    return unsuitable


def _existing() -> str | None:
    configuration = VENV / "pyvenv.cfg"
    if not configuration.is_file():
        return None
    settings = dict(line.split(" = ", 1) for line in configuration.read_text().splitlines() if " = " in line)
    return settings.get("executable")

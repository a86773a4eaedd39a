"""The two ways to the same graph: ROS 2 Jazzy as wheels, or a sourced ROS 2 Jazzy installation."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

from hsv_setup.console import SetupError
from hsv_setup.paths import ROOT

# Set by env.sh and by sourced ROS installations; each names directories that a build would pick packages up from.
_SEARCH_PATHS = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PKG_CONFIG_PATH",
    "PYTHONPATH",
)
# Of an activated or sourced environment, of make's job server, or of pip's own settings for installing elsewhere.
_NEVER_INHERITED = (
    "VIRTUAL_ENV",
    "HSV_ROOT",
    "PYTHONHOME",
    "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
    "MAKEFLAGS",
    "MFLAGS",
    "MAKELEVEL",
    "PIP_USER",
    "PIP_TARGET",
    "PIP_PREFIX",
    "PIP_REQUIRE_VIRTUALENV",
)


@dataclass(frozen=True)
class Route:
    """Source of ROS on the machine, and what the set-up has to do for it."""

    name: str
    requirements: tuple[str, ...]
    """Files of requirements: what the workspace is built with first, then what is installed beside that build."""
    constraints: str
    system_site_packages: bool
    """Whether the virtual environment sees the system's rclpy."""
    wheels: bool
    """Whether ROS is installed as wheels: their paths need relocating, and there is no `ros2` command."""


WHEELS = Route("wheels", ("requirements-ros.txt", "requirements.txt"), "constraints.txt", False, True)
JAZZY = Route("jazzy", ("requirements.txt",), "constraints-jazzy.txt", True, False)


def choose(environ: Mapping[str, str]) -> Route:
    """Return the route for this shell: a sourced Jazzy is used, any other sourced distribution is refused.

    Raises:
        SetupError: another ROS distribution than Jazzy is sourced.
    """
    distro = environ.get("ROS_DISTRO", "")
    if not distro:
        return WHEELS
    if distro == "jazzy":
        return JAZZY
    raise SetupError(f"ROS_DISTRO={distro} is sourced, the bench needs jazzy: use a shell without it, or source Jazzy")


def clean_environment(route: Route, environ: Mapping[str, str]) -> dict[str, str]:
    """Return the variables that set-up commands run with.

    What this checkout's own env.sh added is taken out again, so that set-up gives the same result in a sourced
    shell; with the wheels nothing else may supply ROS packages either.
    """
    env = {name: value for name, value in environ.items() if name not in _NEVER_INHERITED}
    for name in _SEARCH_PATHS:
        entries = [] if route.wheels else [entry for entry in env.get(name, "").split(os.pathsep) if _foreign(entry)]
        if entries:
            env[name] = os.pathsep.join(entries)
        else:
            env.pop(name, None)
    env["PATH"] = os.pathsep.join(entry for entry in env.get("PATH", os.defpath).split(os.pathsep) if _foreign(entry))
    return env


def _foreign(entry: str) -> bool:
    return bool(entry) and entry != str(ROOT) and not entry.startswith(f"{ROOT}{os.sep}")

"""Settings of Fast DDS that the nodes start with, unless somebody has settings of their own."""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from pathlib import Path

PROFILES = Path(__file__).with_name("fastdds.xml")
"""The settings: how often a node announces itself at first, and when its own threads are woken."""

_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
_OWN_FILE = "DEFAULT_FASTRTPS_PROFILES.xml"
"""What Fast DDS reads in the working directory."""


def prefer_profiles(environment: MutableMapping[str, str] = os.environ, directory: Path | None = None) -> None:
    """Have Fast DDS read :data:`PROFILES`; before the first node is made.

    Where the ``environment`` names a file, or the working ``directory`` has one that Fast DDS reads, that holds alone.
    """
    if not any(name in environment for name in _VARIABLES) and not Path(directory or "", _OWN_FILE).exists():
        environment[_VARIABLES[0]] = str(PROFILES)

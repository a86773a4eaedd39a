"""Description of the machine that is measured, and of its load by other programs."""

from __future__ import annotations

import os
import platform
from pathlib import Path


def hardware() -> str:
    """Return processor and cores."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        name = models[0].split(":", 1)[1].strip() if models else name
    return f"{name}, {os.cpu_count()} cores"


def machine() -> str:
    """Return processor, cores, system, Python and how busy it is just now, in one line."""
    load = f", load average before {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{hardware()}, {platform.system()}, Python {platform.python_version()}{load}"


def busy() -> str:
    """Return a warning if other programs slow this machine down; else nothing."""
    cores = os.cpu_count() or 1
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    if load < 0.5 * cores:
        return ""
    return (
        f"load average {load:.1f} on {cores} cores: figures of several processes will be worse than on an idle machine"
    )

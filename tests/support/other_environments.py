"""Flights in another process: with another Python, other packages, another processor, or other library settings."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from hsv.control.design_file import find_design, read_design
from hsv.flight.fingerprint import as_published
from hsv.flight.scenario import load_scenario
from portability import Environment, own

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(__file__).with_name("flight_fingerprints.py")
VARIANTS = "case1_derived", "case1_rmpc", "case1_tube_dm", "case1_integral_heavy", "case2_derived"
SCENARIOS = ("case1", "case2", "winged_cone", *VARIANTS)
"""Together: every vehicle structure, model and coupling, commands, faults, and every law without a solver in flight."""


def fly(environment: Environment | None = None, **variables: str) -> dict[str, Any]:
    """Fly all of :data:`SCENARIOS` in a new process; return what :mod:`flight_fingerprints` prints.

    Args:
        environment: The Python to fly with; by default the project's own.
        variables: Environment variables in addition to a minimal set; those of this process are not inherited.

    Raises:
        AssertionError: The program failed; the message has its output.
    """
    chosen = environment or own()
    plain = {
        "PATH": os.defpath,
        "HOME": os.environ.get("HOME", "/"),
        "HSV_DESIGN_PATH": str(ROOT / "offline_design"),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONPATH": os.pathsep.join([chosen.library, chosen.packages]),
    }
    command = [*chosen.command, "-S", str(PROGRAM), *SCENARIOS]
    done = subprocess.run(command, env=plain | variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


def changed_flights(report: dict[str, Any]) -> dict[str, str]:
    """Return the fingerprints in a report of :func:`fly` that differ from those published for these designs."""
    changed = {}
    for name in SCENARIOS:
        found, scenario = report["fingerprints"][name], load_scenario(name)
        design = read_design(find_design(scenario.design))
        if not as_published(found, scenario, design.digest):
            changed[name] = found
    return changed

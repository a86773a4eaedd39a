"""Flying in another process: another Python or packages, another processor, or other choices that libraries make."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from hsv.control.design import find_design, read_design
from hsv.flight.fingerprint import as_published
from hsv.flight.scenario import load_scenario
from portability import Environment, own

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(__file__).with_name("flight_fingerprints.py")
VARIANTS = "case1_derived", "case1_rmpc", "case1_tube_dm", "case1_integral_heavy", "case2_derived"
SCENARIOS = ("case1", "case2", "winged_cone", *VARIANTS)
"""Structures, models and couplings of the vehicle, every law that solves no problem in flight, commands and faults."""


def fly(environment: Environment | None = None, **variables: str) -> dict[str, Any]:
    """Fly all of :data:`SCENARIOS`; return what :mod:`flight_fingerprints` prints.

    Args:
        environment: The Python to fly on; the project's own where none is given.
        variables: Environment variables over the plain ones: nothing of this process' environment is handed on.

    Raises:
        AssertionError: The program failed; with what it said.
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
    """Return, of what :func:`fly` returns, the fingerprints that are not those published for these designs."""
    changed = {}
    for name in SCENARIOS:
        found, scenario = report["fingerprints"][name], load_scenario(name)
        design = read_design(find_design(scenario.design))
        if not as_published(found, scenario, design.digest):
            changed[name] = found
    return changed

"""Regenerate a constraints file from pip's resolver, for every supported Python at once.

    python3 tools/lock.py constraints.txt python3.11 python3.12
    python3 tools/lock.py constraints-jazzy.txt python3.12
    python3 tools/lock.py constraints.txt python3.11 python3.12 --upgrade cffi scipy
    python3 tools/lock.py constraints.txt python3.11 python3.12 --upgrade all

Each interpreter resolves with its own pip (a dry run: nothing is installed). Pins of the existing file are kept
unless --upgrade names them; "all" lets go of everything but the ROS packages, whose versions make the distribution:
those move only when named. The list comes from pip's resolver report and not from "pip freeze", which also prints
names found inside the ROS wheels.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HEADER = "# Exact versions of everything installed. Made by tools/lock.py; do not edit by hand.\n"

# What each lock resolves, and what it may not move away from.
LOCKS: dict[str, tuple[list[str], list[str]]] = {
    # The ROS wheels are compiled against numpy 2.4; requirements-ros.txt holds setuptools back.
    "constraints.txt": (
        [
            "requirements-setup.txt",
            "requirements-ros.txt",
            "requirements.txt",
            "requirements-viewers.txt",
            "requirements-bench.txt",
            "requirements-docs.txt",
        ],
        ["numpy==2.4.*"],
    ),
    # Ubuntu 24.04 builds ROS 2 Jazzy against its numpy 1.26, Jazzy's pytest plugins are written for pytest 7, and
    # its colcon needs a setuptools that still has "develop".
    "constraints-jazzy.txt": (
        [
            "requirements.txt",
            "requirements-viewers.txt",
            "requirements-bench.txt",
            "requirements-docs.txt",
        ],
        ["numpy==1.26.4", "pytest<8", "setuptools<80"],
    ),
}

Pins = dict[str, str]


def normalise(name: str) -> str:
    """Return the canonical spelling of a distribution name (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def kept_pins(text: str, upgrade: list[str]) -> list[str]:
    """Return the lines of an existing constraints file that the new resolution has to respect."""
    names = {normalise(name) for name in upgrade}
    kept = []
    for line in text.splitlines():
        name = normalise(line.split("==")[0].strip())
        if not line.strip() or line.startswith("#") or name in names:
            continue
        if "all" in names and not name.startswith("ros-"):
            continue
        kept.append(line)
    return kept


def resolve(python: str, requirements: list[str], constraints: list[str]) -> tuple[str, Pins]:
    """Return the interpreter's version ("3.11") and the versions its pip chooses, by canonical name."""
    with tempfile.TemporaryDirectory() as scratch:
        pins, report = Path(scratch, "pins.txt"), Path(scratch, "report.json")
        pins.write_text("\n".join(constraints) + "\n")
        command = [python, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet", "--no-input"]
        command += ["--report", str(report), "--constraint", str(pins)]
        for name in requirements:
            command += ["--requirement", str(ROOT / name)]
        subprocess.run(command, check=True)
        resolved = json.loads(report.read_text())
    found = {normalise(item["metadata"]["name"]): item["metadata"]["version"] for item in resolved["install"]}
    return resolved["environment"]["python_version"], found


def merge(by_python: dict[str, Pins]) -> list[str]:
    """Return constraint lines that hold for all resolved Pythons; a marker only where they differ."""
    lines = []
    for name in sorted(set().union(*by_python.values())):
        versions = {python: pins.get(name) for python, pins in by_python.items()}
        if len(set(versions.values())) == 1:
            lines.append(f"{name}=={versions.popitem()[1]}")
            continue
        for python, version in sorted(versions.items()):
            if version is not None:
                lines.append(f'{name}=={version} ; python_version == "{python}"')
    return lines


def main() -> int:
    """Resolve for each interpreter, merge, and write the file when all of them succeeded."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lock", choices=sorted(LOCKS), help="the file to regenerate")
    parser.add_argument("pythons", nargs="+", metavar="PYTHON", help="an interpreter with pip, one for each version")
    parser.add_argument("--upgrade", nargs="+", default=[], metavar="NAME", help='packages to let go of, or "all"')
    arguments = parser.parse_args()

    requirements, limits = LOCKS[arguments.lock]
    target = ROOT / arguments.lock
    constraints = limits + (kept_pins(target.read_text(), arguments.upgrade) if target.exists() else [])
    by_python: dict[str, Pins] = {}
    for python in arguments.pythons:
        print(f"resolving {arguments.lock} with {python} ...", flush=True)
        version, pins = resolve(python, requirements, constraints)
        by_python[version] = pins
    lines = merge(by_python)
    target.write_text(HEADER + "# Python " + ", ".join(sorted(by_python)) + ".\n" + "\n".join(lines) + "\n")
    print(f"{target.name}: {len(lines)} pins")
    return 0


if __name__ == "__main__":
    sys.exit(main())

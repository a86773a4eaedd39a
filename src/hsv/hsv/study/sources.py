"""What the outcome of a flight depends on, as one digest: results are kept under it and found again by it."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from hsv.control.design_file import find_design
from hsv.simulation.scenario import load_scenario, scenario_text

_FLOWN = ("control", "faults", "lpv", "simulation", "vehicle")
"""Packages whose code a flight runs through; the vehicle's table is among them."""

_RUNNING = ("graph", "recording")
"""Packages whose code starts the nodes, exchanges their messages, and writes and reads bags."""

DIGITS = 12
"""Digits of a digest in the name of a folder: enough that none meets another."""


@cache
def package_digest(*names: str) -> str:
    """Return the digest of the code and tables in packages, ``names`` below the root, with those inside them."""
    root = Path(str(files("hsv")))
    paths = [path for name in names for path in root.joinpath(name).rglob("*") if path.suffix in (".py", ".toml")]
    return digest_of(path.read_bytes() for path in sorted(paths))


@cache
def code_digest() -> str:
    """Return the digest of the code and the vehicle table that a flight runs through."""
    root = Path(str(files("hsv")))
    paths = [path for name in _FLOWN for path in root.joinpath(name).glob("*") if path.suffix in (".py", ".toml")]
    return digest_of(path.read_bytes() for path in (*sorted(paths), root / "units.py"))


@cache
def nodes_digest() -> str:
    """Return the digest of what a run of the graph hangs on beside the flight: nodes, messages, starting, recording.

    The nodes are those of the sourced workspace, wherever it is: of all its packages named hsv_* the modules as they
    would be imported and the definitions of messages and services.
    """
    # Of the sourced workspace: without one there is no graph, nor this package.
    from ament_index_python.packages import get_packages_with_prefixes

    parts = [package_digest(*_RUNNING).encode()]
    for name, prefix in sorted(get_packages_with_prefixes().items()):
        if name.startswith("hsv_"):
            share, spec = Path(prefix, "share", name), find_spec(name)
            paths = [path for kind in ("msg", "srv") for path in sorted(share.glob(f"{kind}/*.{kind}"))]
            for folder in (spec and spec.submodule_search_locations) or ():
                paths += sorted(Path(folder).rglob("*.py"))
            parts += [part for path in paths for part in (path.name.encode(), path.read_bytes())]
    return digest_of(parts)


def flight_digest(scenario: str, *, graph: bool = False) -> str:
    """Return the digest of everything that the flight of ``scenario`` (name or path) depends on.

    Args:
        scenario: A shipped one's name, or a path.
        graph: Flown by the nodes, whose code counts then.

    Raises:
        ScenarioError, DesignError: No such scenario, or its design is not there.
    """
    design = find_design(load_scenario(scenario).design).read_bytes()
    code = [code_digest(), nodes_digest()] if graph else [code_digest()]
    return digest_of((scenario_text(scenario).encode(), design, *(digest.encode() for digest in code)))


def drop_older(path: Path) -> None:
    """Remove what was kept beside ``path`` under the same name and another digest: what it depended on is gone."""
    name, _, rest = path.name.rpartition("_")
    for other in path.parent.glob(f"{name}_{'[0-9a-f]' * DIGITS}{rest[DIGITS:]}"):
        if other != path:
            shutil.rmtree(other) if other.is_dir() else other.unlink()


def file_bytes(name: str) -> bytes:
    """Return the contents of a file of this package, ``name`` below its root."""
    return files("hsv").joinpath(name).read_bytes()


def digest_of(parts: Iterable[bytes]) -> str:
    """Return one digest of several contents."""
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()

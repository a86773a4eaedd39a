"""Digest of everything that the outcome of a flight depends on; results are stored and found by it."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable, Iterable
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TypeVar

from hsv.control.design import find_design
from hsv.flight.scenario import load_scenario, scenario_text

Result = TypeVar("Result")

_FLOWN = ("base", "core", "model", "control", "flight")
"""Packages whose code a flight runs through; the vehicle's table is among them."""

_RUNNING = ("graph", "bags")
"""Packages whose code starts the nodes, exchanges their messages, and writes and reads bags."""

DIGITS = 12
"""Digits of a digest in the name of a folder: enough that none meets another."""


@cache
def package_digest(*names: str) -> str:
    """Return the digest of the code and tables in packages, ``names`` below the root, with those inside them."""
    root = Path(str(files("hsv")))
    paths = [
        path for name in names for path in root.joinpath(name).rglob("*") if path.suffix in (".py", ".toml", ".c", ".h")
    ]
    return digest_of(path.read_bytes() for path in sorted(paths))


@cache
def code_digest() -> str:
    """Return the digest of the code and the vehicle table that a flight runs through."""
    return package_digest(*_FLOWN)


def measuring_code(*modules: str) -> list[bytes]:
    """Return the sources of modules on which measurements of flights depend besides the flights themselves."""
    return [Path(str(spec.origin)).read_bytes() for spec in map(find_spec, modules) if spec]


@cache
def nodes_digest() -> str:
    """Return the digest of everything that a run of the graph depends on besides the flight: nodes, messages, start.

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


def kept(
    path: Path, make: Callable[[], Result], save: Callable[[Path, Result], None], load: Callable[[Path], Result]
) -> Result:
    """Return the contents of the file ``path``, whose name ends in a digest; if there is none, compute and store them.

    A file is there only when it is whole, and what was kept under another digest is dropped.
    """
    if path.is_file():
        return load(path)
    made = make()
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f".{path.name}")
    save(new, made)
    new.rename(path)
    drop_older(path)
    return made


def drop_older(path: Path) -> None:
    """Remove outdated files: those with the name of ``path`` and another digest."""
    name, _, rest = path.name.rpartition("_")
    for other in path.parent.glob(f"{name}_{'[0-9a-f]' * DIGITS}{rest[DIGITS:]}"):
        if other != path:
            shutil.rmtree(other) if other.is_dir() else other.unlink()


def digest_of(parts: Iterable[bytes]) -> str:
    """Return one digest of several contents."""
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()

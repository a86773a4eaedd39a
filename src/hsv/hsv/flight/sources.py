"""Digests of everything on which the outcome of a flight depends; they identify stored results."""

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
"""Packages with the code and the vehicle tables that a flight uses."""

_RUNNING = ("graph", "bags")
"""Packages with the code that starts the nodes, exchanges their messages, and writes and reads bags."""

DIGITS = 12
"""Digits of a digest in the name of a folder, enough to avoid collisions."""


@cache
def package_digest(*names: str) -> str:
    """Return the digest of code and tables in the packages ``names`` of ``hsv``, including their subpackages."""
    root = Path(str(files("hsv")))
    paths = [
        path for name in names for path in root.joinpath(name).rglob("*") if path.suffix in (".py", ".toml", ".c", ".h")
    ]
    return digest_of(path.read_bytes() for path in sorted(paths))


@cache
def code_digest() -> str:
    """Return the digest of the code and the vehicle tables that a flight uses."""
    return package_digest(*_FLOWN)


def measuring_code(*modules: str) -> list[bytes]:
    """Return the sources of the modules that compute measurements of flights."""
    return [Path(str(spec.origin)).read_bytes() for spec in map(find_spec, modules) if spec]


@cache
def nodes_digest() -> str:
    """Return the digest of the code that runs the graph: nodes, messages and launcher.

    It covers the modules and the message and service definitions of all packages hsv_* of the sourced workspace.
    """
    # Imported here because this package exists only in a sourced workspace.
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
    """Return the digest of everything on which the flight of a scenario depends.

    Args:
        scenario: Name of a shipped scenario, or a path.
        graph: Whether the nodes fly the scenario, so that their code is included.

    Raises:
        ScenarioError, DesignError: The scenario or its design does not exist.
    """
    design = find_design(load_scenario(scenario).design).read_bytes()
    code = [code_digest(), nodes_digest()] if graph else [code_digest()]
    return digest_of((scenario_text(scenario).encode(), design, *(digest.encode() for digest in code)))


def kept(
    path: Path, make: Callable[[], Result], save: Callable[[Path, Result], None], load: Callable[[Path], Result]
) -> Result:
    """Return the contents of the file ``path``, whose name ends in a digest; compute and store them if it is missing.

    The file is written atomically; files with another digest are removed.
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
    """Remove outdated files, which have the name of ``path`` with another digest."""
    name, _, rest = path.name.rpartition("_")
    for other in path.parent.glob(f"{name}_{'[0-9a-f]' * DIGITS}{rest[DIGITS:]}"):
        if other != path:
            shutil.rmtree(other) if other.is_dir() else other.unlink()


def digest_of(parts: Iterable[bytes]) -> str:
    """Return one digest (SHA-256) for several contents."""
    total = hashlib.sha256()
    for part in parts:
        total.update(hashlib.sha256(part).digest())
    return total.hexdigest()

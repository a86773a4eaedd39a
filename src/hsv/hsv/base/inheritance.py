"""TOML files that extend another one and hold only what differs: ``extends = "case1"``."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

from hsv.base.errors import HsvError

EXTENDS = "extends"
"""The key that names the file before it, by name or by path; a path is relative to the folder of the file it is in."""

Tables = dict[str, Any]


def follow_extends(
    name: str,
    read: Callable[[str], Tables],
    refuse: Callable[[str, str], HsvError],
    replaced: Collection[str] = (),
    values: Collection[str] = (),
) -> Tables:
    """Return the contents of a file with those of the files that it extends, one by one, under it.

    Tables are merged key by key; everything else, lists of tables too, is replaced.

    Args:
        name: Name or path of the file.
        read: Returns the contents of a file by name or path.
        refuse: Returns the error for a file, by name or path, and what is wrong with it.
        replaced: Tables at the top that are replaced whole.
        values: Keys of tables that stand for one value, and are replaced whole wherever they are.

    Raises:
        HsvError: Error of ``refuse``: ``extends`` is not the name of a file, or the files extend each other.
    """
    chain, layers = [name], [dict(read(name))]
    while EXTENDS in layers[-1]:
        base = layers[-1].pop(EXTENDS)
        if not isinstance(base, str) or not base:
            raise refuse(chain[-1], f"{EXTENDS} = {base!r}: expected a name or the path of a file")
        path = is_path(base)
        chain.append(str(Path(chain[-1]).parent / base) if path and is_path(chain[-1]) else base)
        if chain[-1] in chain[:-1]:
            raise refuse(name, f"{EXTENDS}: {' extends '.join(chain)}, expected files that do not extend each other")
        layers.append(dict(read(chain[-1])))
    merged: Tables = {}
    for layer in reversed(layers):
        merged = _merged(
            {key: value for key, value in merged.items() if key not in {*replaced} & layer.keys()}, layer, {*values}
        )
    return merged


def is_path(name: str) -> bool:
    """Tell whether a scenario or design is named by its path."""
    return "/" in name or name.endswith(".toml")


def _merged(base: Tables, own: Tables, values: set[str]) -> Tables:
    merged = dict(base)
    for key, value in own.items():
        both = isinstance(value, dict) and isinstance(base.get(key), dict) and not values & value.keys()
        merged[key] = _merged(base[key], value, values) if both else value
    return merged

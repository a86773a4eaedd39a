"""Read TOML, YAML and JSON files with limits on size and nesting, and TOML files that extend another one.

Reading any file ends, with values or with one line of error: a pipe, a device, a text that is too large or nested too
deep is refused before anything else is done with it.
"""

from __future__ import annotations

import errno
import json
import math
import os
import re
import stat
import tomllib
from collections.abc import Callable, Collection, Mapping
from functools import partial
from io import BufferedReader
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.resolver import Resolver

from hsv.base.errors import DocumentError, HsvError, reason

if yaml.__with_libyaml__:
    from yaml.cyaml import CParser as _Parser  # type: ignore[attr-defined]
else:
    from yaml.parser import Parser
    from yaml.reader import Reader
    from yaml.scanner import Scanner

    class _Parser(Reader, Scanner, Parser):  # type: ignore[no-redef]
        def __init__(self, stream: str) -> None:
            Reader.__init__(self, stream)
            Scanner.__init__(self)
            Parser.__init__(self)


MAX_BYTES = 2**22
"""Maximum size of a text, bytes; designs and certificates are at least thirty times smaller."""

MAX_LEVELS = 64
"""Depth of tables and lists."""

MAX_NODES = 10**6
"""Values of a YAML text; an alias counts as all values that it stands for."""

_MAX_DIGITS = 4000
_LARGEST = 10**_MAX_DIGITS

_LONG_KEY = re.compile(rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MAX_LEVELS}}}""")
"""A dotted key that nests too deep: the parser needs a time quadratic in its length."""


def open_regular(path: Path) -> BufferedReader:
    """Return the file ``path``, open for reading.

    Raises:
        DocumentError: The system refuses, or the file is not a regular one: reading a pipe need not end.
    """
    try:
        # Without O_NONBLOCK, opening a pipe would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise DocumentError(f"cannot be read ({reason(error)})") from error
    except ValueError as error:
        raise DocumentError("cannot be read (a zero byte in its name)") from error
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        why = os.strerror(errno.EISDIR) if stat.S_ISDIR(mode) else "not a regular file"
        raise DocumentError(f"cannot be read ({why})")
    return os.fdopen(descriptor, "rb")


def read_bytes(path: Path, max_bytes: int | None = None) -> bytes:
    """Return the contents of the file ``path``; a file larger than ``max_bytes`` is refused."""
    with open_regular(path) as stream:
        if max_bytes is not None and os.fstat(stream.fileno()).st_size > max_bytes:
            raise DocumentError(f"cannot be read (more than {max_bytes} bytes)")
        try:
            return stream.read()
        except OSError as error:
            raise DocumentError(f"cannot be read ({reason(error)})") from error


def read_text(path: Path) -> str:
    """Return the text in the file ``path``, without a byte order mark and with the line ends of Unix."""
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise DocumentError("cannot be read (not text)") from error


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables in a TOML text.

    Raises:
        DocumentError: The text is not TOML, too long or nested too deep.
    """
    _check_length(text)
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise DocumentError(f"a key nested more than {MAX_LEVELS} levels deep (at line {line})")
    return _parsed(text, tomllib.loads)


def parse_json(text: str | bytes) -> Any:
    """Return the value in a JSON text.

    Raises:
        DocumentError: The text is not JSON, too long or nested too deep, or a key occurs twice in an object.
    """
    _check_length(text)
    return _parsed(text, partial(json.loads, object_pairs_hook=_without_duplicates))


def parse_yaml(text: str) -> Any:
    """Return the value in a YAML text, of plain types.

    Raises:
        DocumentError: The text is not YAML, too long or nested too deep, a key occurs twice in a mapping, or aliases
            expand to too many values.
    """
    _check_length(text)
    try:
        values = yaml.load(text, _Loader)  # type: ignore[arg-type]
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise DocumentError(" ".join(str(error).split()).replace(' in "<unicode string>",', " at")) from error
    _check(values)
    return values


class _Loader(Composer, _Parser, SafeConstructor, Resolver):
    """The safe loader on the parser of the C library, whose own composer overflows the stack on deep nesting."""

    def __init__(self, stream: str) -> None:
        _Parser.__init__(self, stream)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)
        self._levels = self._nodes = 0
        self._sizes: dict[Any, int] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next node; count levels, and nodes including those of aliases."""
        event, before = self.peek_event(), self._nodes
        self._levels += 1
        if self._levels > MAX_LEVELS:
            raise _refused(f"nested more than {MAX_LEVELS} levels deep", event)
        node = super().compose_node(parent, index)
        self._levels -= 1
        if not isinstance(event, yaml.AliasEvent):
            self._nodes += 1
            self._sizes[node] = self._nodes - before
        elif node in self._sizes:
            self._nodes += self._sizes[node]
        else:
            raise _refused(f"the alias {event.anchor!r} stands inside of what it is for", event)
        if self._nodes > MAX_NODES:
            raise _refused(f"more than {MAX_NODES} values", event)
        return node

    def compose_mapping_node(self, anchor: Any) -> Any:
        """Return the next mapping; its keys must differ."""
        node = super().compose_mapping_node(anchor)
        seen: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in seen:
                    raise _refused(f"the key {key.value!r} occurs twice", key)
                seen.add((key.tag, key.value))
        return node


# A number for ROS and YAML 1.2, but a text for YAML 1.1, which wants a point and a sign: 5665e-11.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)[eE][-+]?\d+$"), list("-+.0123456789")
)


def _parsed(text: Any, parse: Callable[[Any], Any]) -> Any:
    try:
        values = parse(text)
    except RecursionError as error:
        raise _too_deep() from error
    except ValueError as error:
        raise DocumentError(str(error)) from error
    _check(values)
    return values


def _refused(why: str, where: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=why, problem_mark=where.start_mark)


def _without_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"the key {next(name for name in names if names.count(name) > 1)!r} occurs twice")
    return values


def _check_length(text: str | bytes) -> None:
    if len(text) > MAX_BYTES:
        raise DocumentError(f"more than {MAX_BYTES} bytes")


def _check(value: object) -> None:
    """Refuse values that are nested too deep, and numbers that Python refuses to print."""
    level = [value]
    for _ in range(MAX_LEVELS + 1):
        if any(isinstance(one, int) and abs(one) >= _LARGEST for one in level):
            raise DocumentError(f"a whole number of more than {_MAX_DIGITS} digits")
        level = [
            entry
            for one in level
            if isinstance(one, dict | list)
            for entry in (one.values() if isinstance(one, dict) else one)
        ]
        if not level:
            return
    raise _too_deep()


def _too_deep() -> DocumentError:
    return DocumentError(f"nested more than {MAX_LEVELS} levels deep")


EXTENDS = "extends"
"""The key that names the extended file, by name or by path relative to the folder of the extending file."""

Tables = dict[str, Any]


def follow_extends(
    name: str,
    read: Callable[[str], Tables],
    refuse: Callable[[str, str], HsvError],
    replaced: Collection[str] = (),
    values: Collection[str] = (),
) -> Tables:
    """Return the contents of a file merged over those of the files that it extends.

    Tables are merged key by key; everything else, lists of tables too, is replaced.

    Args:
        name: Name or path of the file.
        read: Returns the contents of a file by name or path.
        refuse: Returns the error for a file, by name or path, and what is wrong with it.
        replaced: Top-level tables that are replaced, not merged.
        values: Keys that mark a table as one value, which is replaced, not merged.

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


def json_text(values: Mapping[str, Any], indent: int | None = None) -> str:
    """Return ``values`` as JSON, on one line without ``indent``.

    JSON lacks numbers that are not finite: they are null.
    """
    return json.dumps(_finite(values), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

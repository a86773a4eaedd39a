"""Read TOML, YAML and JSON files with limits on size and nesting, and TOML files that extend another one.

Reading always ends, with values or with an error message of one line: a pipe, a device, and a text that is too large or
nested too deeply are refused.
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
"""Maximum nesting depth of tables and lists."""

MAX_NODES = 10**6
"""Maximum number of values in a YAML text; an alias counts as all the values that it stands for."""

_MAX_DIGITS = 4000
_LARGEST = 10**_MAX_DIGITS

_LONG_KEY = re.compile(rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{MAX_LEVELS}}}""")
"""A dotted TOML key with too many parts; it is refused first because parsing time is quadratic in its length."""


def open_regular(path: Path) -> BufferedReader:
    """Open the regular file ``path`` for reading and return it.

    Raises:
        DocumentError: The file cannot be opened, or it is not a regular file; reading a pipe might never end.
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
    """Return the UTF-8 text in the file ``path``, at most 4 MiB, without a byte order mark and with Unix line ends."""
    try:
        return read_bytes(path, MAX_BYTES).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise DocumentError("cannot be read (not text)") from error


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables in a TOML text.

    Raises:
        DocumentError: The text is not TOML, too long or nested too deep, or an integer in it is too long.
    """
    _check_length(text)
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise DocumentError(f"a key nested more than {MAX_LEVELS} levels deep (at line {line})")
    return _parsed(text, tomllib.loads)


def parse_json(text: str | bytes) -> Any:
    """Return the value in a JSON text.

    Raises:
        DocumentError: The text is not JSON, too long or nested too deep, a key occurs twice, or an integer is too long.
    """
    _check_length(text)
    return _parsed(text, partial(json.loads, object_pairs_hook=_without_duplicates))


def parse_yaml(text: str) -> Any:
    """Return the value in a YAML text, built from Python's basic types only.

    Raises:
        DocumentError: The text is not YAML, too long or nested too deep, a key occurs twice in a mapping, an integer is
            too long, or there are too many values, with aliases expanded.
    """
    _check_length(text)
    try:
        values = yaml.load(text, _Loader)  # type: ignore[arg-type]
    except (yaml.YAMLError, ValueError, OverflowError) as error:
        raise DocumentError(" ".join(str(error).split()).replace(' in "<unicode string>",', " at")) from error
    _check(values)
    return values


class _Loader(Composer, _Parser, SafeConstructor, Resolver):
    """PyYAML's safe loader with the parser in C, if installed, and the composer in Python, which limits the nesting."""

    def __init__(self, stream: str) -> None:
        _Parser.__init__(self, stream)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)
        self._levels = self._nodes = 0
        self._sizes: dict[Any, int] = {}

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next YAML node; check the nesting depth and the number of nodes, with aliases expanded."""
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
            raise _refused(f"the alias {event.anchor!r} refers to a value that contains it", event)
        if self._nodes > MAX_NODES:
            raise _refused(f"more than {MAX_NODES} values", event)
        return node

    def compose_mapping_node(self, anchor: Any) -> Any:
        """Return the next mapping; refuse a key that occurs twice."""
        node = super().compose_mapping_node(anchor)
        seen: set[tuple[str, str]] = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                if (key.tag, key.value) in seen:
                    raise _refused(f"the key {key.value!r} occurs twice", key)
                seen.add((key.tag, key.value))
        return node


# 5665e-11 is a number in ROS and YAML 1.2, but a text in YAML 1.1, which requires a decimal point and a sign.
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
    """Raise a DocumentError if values are nested too deeply or an integer is too long for Python to print."""
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
"""Key whose value is the extended file: its name, or its path relative to the folder of the extending file."""

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
        read: Function that returns the contents of a file, given its name or path.
        refuse: Function that returns an error, given the name or path of a file and what is wrong with it.
        replaced: Top-level tables that are replaced, not merged.
        values: Keys that mark a table as one value, which is replaced, not merged.

    Raises:
        HsvError: The error from ``refuse``, if ``extends`` is not the name of a file or files extend each other.
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
    """Return whether ``name`` contains a slash or ends in ``.toml``, and so is a path rather than a registered name."""
    return "/" in name or name.endswith(".toml")


def _merged(base: Tables, own: Tables, values: set[str]) -> Tables:
    merged = dict(base)
    for key, value in own.items():
        both = isinstance(value, dict) and isinstance(base.get(key), dict) and not values & value.keys()
        merged[key] = _merged(base[key], value, values) if both else value
    return merged


def json_text(values: Mapping[str, Any], indent: int | None = None) -> str:
    """Return ``values`` as JSON, on one line if ``indent`` is None.

    Numbers that are not finite become null, because JSON has no such numbers.
    """
    return json.dumps(_finite(values), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""Functions that were compiled ahead of time, called without numba.

They are in a library that :mod:`hsv.ahead_of_time` writes, with an index of which functions there are in it and for
which types of arguments. Its functions take and return Python's objects. An array that is returned is a copy, also of
an argument.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import platform
from collections.abc import Callable, Sequence
from functools import cache
from itertools import takewhile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hsv import IMPORTED_AT
from hsv.lane_arrays import LaneArray, LaneRecord

PACKAGE = Path(__file__).parent
INDEX = Path(os.environ.get("NUMBA_CACHE_DIR") or PACKAGE / "__pycache__", "ahead_of_time.json")
"""What was compiled ahead of time, from which sources, for which processor; the library lies beside it."""

_NUMBA_SETTINGS = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS")
"""Environment variables of numba's that leave the code as it is."""

_CLOCK_STEP = 20_000_000
"""Nanoseconds by which the system's time of a change of a file may be behind its clock: twice its longest tick."""

_NUMBERS: dict[type, str] = {
    float: "float64",
    np.float64: "float64",
    int: "int64",
    np.int64: "int64",
    bool: "bool",
    np.bool_: "bool",
}
_ELEMENTS = {np.dtype(name): name for name in ("float64", "int64", "uint32", "uint64", "bool", "complex128")}
_LAYOUT = 16
"""Size of what every object of Python's begins with, as ``run_time.c`` has it: other Pythons have another."""


class NotAheadOfTimeError(TypeError):
    """An argument of a type that functions compiled ahead of time do not take."""


def types_of(arguments: Sequence[Any]) -> tuple[str, ...]:
    """Return the types of arguments as the index names them.

    Raises:
        NotAheadOfTimeError: An argument has another type.
    """
    return tuple(map(_type_of, arguments))


def _type_of(value: Any) -> str:
    kind = type(value)
    if kind in _NUMBERS:
        return _NUMBERS[kind]
    if value is None:
        return "None"
    if isinstance(value, tuple):
        return f"{kind.__module__}.{kind.__qualname__}({' '.join(map(_type_of, value))})"
    if kind is np.ndarray and value.dtype in _ELEMENTS and value.flags.aligned:
        layout = "C" if value.flags.c_contiguous else "F" if value.flags.f_contiguous else "A"
        return f"{_ELEMENTS[value.dtype]}[{value.ndim}{layout}{'' if value.flags.writeable else ' read-only'}]"
    if kind is LaneArray or kind is LaneRecord:
        return str(value.kind)
    raise NotAheadOfTimeError(f"argument of type {kind.__name__}")


class Result(NamedTuple):
    """What a function returns, as the index describes it."""

    array: str = ""
    """Type of the elements of an array, empty of what is none"""
    elements: tuple[Any, ...] = ()
    """Those of a tuple"""

    @classmethod
    def read(cls, entry: Any) -> Result:
        """Return the result that a value of JSON describes."""
        array, elements = entry
        return cls(array, tuple(map(cls.read, elements)))

    @property
    def holds_arrays(self) -> bool:
        """Whether it is an array or holds one."""
        return bool(self.array) or any(element.holds_arrays for element in self.elements)

    def value(self, returned: Any, release: Callable[[int], None]) -> Any:
        """Return the value of what an entry returned, in which an array is a tuple of memory, address and shape.

        The memory is given to ``release``.
        """
        if self.elements:
            return tuple(each.value(one, release) for each, one in zip(self.elements, returned, strict=True))
        if not self.array:
            return returned
        memory, address, *shape = returned
        array = np.empty(shape, self.array)
        ctypes.memmove(array.ctypes.data, address, array.nbytes)
        release(memory)
        return array


class Entry:
    """A function of the library, for arguments of certain types."""

    def __init__(self, library: ctypes.PyDLL, symbol: str, result: Result) -> None:
        self._function = library[symbol]
        self._function.argtypes, self._function.restype = (ctypes.py_object,), ctypes.py_object
        self._release = library.hsv_release
        self._release.argtypes, self._release.restype = (ctypes.c_void_p,), None
        self._result = result if result.holds_arrays else None

    def __call__(self, *arguments: Any) -> Any:
        """Return what the function returns for arguments of the types that the entry is for.

        Raises:
            TypeError: An argument is of another type.
            OverflowError: A whole number has more than 64 bits.
            RuntimeError: The function raised an error, as where it divides by zero and Python's rules hold.
        """
        returned = self._function(arguments)
        return self._result.value(returned, self._release) if self._result else returned


def entry_for(name: str, arguments: Sequence[Any]) -> Entry | None:
    """Return the entry of a function, by its full name, for such arguments, ``None`` where there is none."""
    entries = _entries().get(name)
    if not entries:
        return None
    try:
        return entries.get(types_of(arguments))
    except NotAheadOfTimeError:
        return None


@cache
def _entries() -> dict[str, dict[tuple[str, ...], Entry]]:
    """Return what was compiled ahead of time and is current, by function and types of arguments."""
    try:
        index = json.loads(INDEX.read_text())
        if index["processor"] != processor() or index["digest"] != digest(index["sources"]) or why_none():
            return {}
        path = INDEX.with_name(index["library"])
        if hashlib.sha256(path.read_bytes()).hexdigest() != index["contents"]:
            return {}  # to call into half a library would end the process
        library = ctypes.PyDLL(str(path))
        library.hsv_begin(ctypes.py_object(np.ndarray))
        return {
            name: {tuple(types): Entry(library, symbol, Result.read(result)) for types, symbol, result in by}
            for name, by in index["functions"].items()
        }
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}


def digest(sources: Sequence[str]) -> str:
    """Return a digest of sources of this package, by their paths in it.

    Raises:
        OSError: One is gone.
    """
    contents = hashlib.sha256()
    for name in sources:
        contents.update(hashlib.sha256((PACKAGE / name).read_bytes()).digest())
    return contents.hexdigest()


def state_of_sources() -> str | None:
    """Return a digest of the sources of this package in Python and C and of its tables, with their names.

    Returns:
        ``None`` where they are not known to be those that this process has imported: one was changed since then, or is
        gone.
    """
    contents = hashlib.sha256()
    found = (path for kind in ("py", "c", "h", "toml") for path in PACKAGE.rglob(f"*.{kind}"))
    # Editors keep locks and copies of unsaved files under names that begin with a dot.
    paths = sorted(path for path in found if not path.name.startswith("."))
    try:
        for path in paths:
            contents.update(os.fsencode(path.relative_to(PACKAGE)) + b"\0")
            contents.update(hashlib.sha256(path.read_bytes()).digest())
            # The time of the content would be that of where it was copied from.
            if path.stat().st_ctime_ns > IMPORTED_AT - _CLOCK_STEP:
                return None
    except OSError:
        return None
    return contents.hexdigest()


def why_none() -> str:
    """Return why no function is compiled ahead of time here, empty where they are."""
    for name in os.environ:
        if name.startswith("NUMBA_") and name not in _NUMBA_SETTINGS:
            return f"{name} is set, which may change the code"
    return "" if object.__basicsize__ == _LAYOUT else "objects of this Python are of another layout"


def processor() -> str:
    """Return a digest of what is said of the first processor's model and instructions, and of numpy's version.

    Under an emulator the system may tell of the processor below; numpy asks the one that there is.
    """
    try:
        with Path("/proc/cpuinfo").open() as file:
            of_first = takewhile(str.strip, file)
            lines = [line for line in of_first if line.startswith(("model name", "flags", "Features"))]
    except OSError:
        lines = [platform.processor()]
    found: Any = np.show_config(mode="dicts")
    instructions = str(found.get("SIMD Extensions"))
    words = [platform.machine(), np.__version__, instructions, *lines]
    return hashlib.sha256("".join(words).encode()).hexdigest()

"""The numeric core in C99, called through cffi: structs filled by the names of their fields.

``core.h`` declares every struct once, and :class:`Struct` fills one. The comment after an array in ``core.h`` gives its
shape; arrays of another shape are refused. Fields that count elements, such as ``sections``, are set from the shapes.
"""

from __future__ import annotations

import os
import re
from array import array
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from functools import cache
from importlib.resources import files
from operator import index
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hsv.base.errors import ParameterError, one_of
from hsv.core._core import ffi, lib

__all__ = [
    "Callback",
    "Struct",
    "compare_enumerators",
    "doubles",
    "dtype",
    "ffi",
    "fly",
    "instruction_set",
    "lanes",
    "lib",
    "loop_memory",
    "records",
    "vector",
]

_STRUCT = re.compile(r"typedef struct \{(.*?)\n\} (\w+);", re.DOTALL)
_POINTER = re.compile(r"(const )?\w+ \*(\w+); *(?:/\* (?:\(([^)]*)\))?(.*?)\*/)?")
_DIMENSION = re.compile(r"(\d+|\w+)(?: \+ (\d+))?(?: <= (\d+))?")
_LANES = {"sse2": 1, "avx2": 4, "avx512": 8}
_ELEMENTS = {"double": np.dtype(float), "int64_t": np.dtype(np.int64), "uint8_t": np.dtype(np.uint8)}


class _Dimension(NamedTuple):
    """The length of an array axis: fixed (``size``), or the field ``counts`` (at most ``greatest``) plus ``more``."""

    text: str
    size: int | None
    counts: str
    more: int
    greatest: int | None

    @classmethod
    def read(cls, text: str) -> _Dimension:
        [(name, more, greatest)] = _DIMENSION.findall(text)
        size = int(name) if name.isdigit() else None
        return cls(text.strip(), size, "" if size else name, int(more or 0), int(greatest) if greatest else None)


class _Pointer(NamedTuple):
    """A pointer in a struct of core.h: whether its array is read only, the shape, and whether NULL is allowed."""

    constant: bool
    shape: tuple[_Dimension, ...]
    optional: bool


@cache
def _pointers(kind: str) -> dict[str, _Pointer]:
    text = files("hsv.core").joinpath("core.h").read_text(encoding="utf-8")
    [body] = [body for body, name in _STRUCT.findall(text) if name == kind]
    return {
        name: _Pointer(bool(constant), tuple(map(_Dimension.read, filter(None, shape.split(",")))), "NULL" in words)
        for constant, name, shape, words in _POINTER.findall(body)
    }


@cache
def _fields(kind: str) -> dict[str, Any]:
    """Return the C types of the fields of a struct by name, except the fields that count elements of arrays."""
    counts = {dimension.counts for pointer in _pointers(kind).values() for dimension in pointer.shape}
    return {name: field.type for name, field in ffi.typeof(kind).fields if name not in counts}


def _element(declared: Any) -> tuple[str, tuple[int, ...]]:
    """Return the name of the element type, and the shape, of a field of the ``declared`` C type."""
    shape = []
    while declared.kind == "array":
        shape.append(declared.length)
        declared = declared.item
    return declared.cname, tuple(shape)


@cache
def dtype(kind: str) -> np.dtype[Any]:
    """Return the structured numpy type of the struct ``kind`` of core.h.

    Raises:
        TypeError: The struct contains pointers or other structs.
    """
    fields = ffi.typeof(kind).fields
    elements = [_element(field.type) for _, field in fields]
    if not {element for element, _ in elements} <= {*_ELEMENTS}:
        raise TypeError(f"expected a Struct {kind}")
    return np.dtype(
        {
            "names": [name for name, _ in fields],
            "formats": [(_ELEMENTS[element], shape) for element, shape in elements],
            "offsets": [field.offset for _, field in fields],
            "itemsize": ffi.sizeof(kind),
        }
    )


def compare_enumerators(kind: str, numbers: Mapping[str, int]) -> None:
    """Compare the enumerators of ``enum kind`` in core.h with the ``numbers`` by name of a table in Python.

    Raises:
        ImportError: They differ: the core was built from other sources than the table.
    """
    compiled = ffi.typeof(f"enum {kind}").relements
    if differing := sorted({*compiled.items()} ^ {*numbers.items()}):
        listed = ", ".join(f"{name} = {number}" for name, number in differing)
        raise ImportError(f"enum {kind} of the core: {listed}, expected the same in core.h and in Python; make setup")


def vector(value: Any) -> np.ndarray:
    """Return ``value`` as a contiguous array of float64, without a copy if it is one."""
    return np.ascontiguousarray(value, float)


def doubles(array: np.ndarray, *shape: int) -> Any:
    """Return a pointer to the numbers of a contiguous ``array`` of float64.

    Raises:
        ValueError: The array is not contiguous or not of the ``shape``, if given; the core itself checks no lengths.
        TypeError: The array is not of float64.
    """
    if array.dtype != np.float64:
        raise TypeError(f"array of {array.dtype}, expected float64")
    if shape and array.shape != shape:
        raise ValueError(f"array of shape {array.shape}, expected {shape}")
    return ffi.from_buffer("double[]", array)


def records(kind: str, array: np.ndarray) -> Any:
    """Return a pointer ``kind *`` to the structs in an ``array`` whose type is :func:`dtype` of ``kind``."""
    return ffi.cast(f"{kind} *", ffi.from_buffer(array))


@cache
def instruction_set() -> str:
    """Return the instruction set of the core: the widest of this processor, or the one in ``HSV_CORE``.

    On processors other than x86-64 there is only one, which is called ``sse2`` as well.

    Raises:
        ParameterError: ``HSV_CORE`` is not an instruction set of this processor.
    """
    usable = [*_LANES][: lib.hsv_widest() + 1]
    chosen = os.environ.get("HSV_CORE") or usable[-1]
    if chosen not in usable:
        raise ParameterError(f"HSV_CORE = {chosen!r}: expected {one_of(usable, chosen, ' on this processor')}")
    return chosen


def lanes() -> int:
    """Return the maximum number of flights that the core can simulate side by side."""
    return _LANES[instruction_set()]


def fly(flights: Sequence[Struct], memory: np.ndarray, start: int, stop: int, halves: int = lib.SENSE | lib.ACT) -> int:
    """Simulate the steps ``start`` ... ``stop`` - 1, or until all have diverged, of one or :func:`lanes` flights.

    Args:
        flights: Structs ``hsv_flight``.
        memory: State of the loop between calls, see :func:`loop_memory`; step 0 initialises it.
        start: First step.
        stop: Step after the last one.
        halves: ``lib.SENSE`` (each step up to the nominal input), ``lib.ACT`` (from the controller on), or both.

    Returns:
        The step after the last one simulated, or -1 - k if an external block failed in step k.

    Raises:
        ValueError: The number of flights is wrong, the memory unsuitable, or a history has fewer rows than steps.
    """
    if len(flights) not in (1, lanes()) or memory.nbytes < lib.hsv_memory_size(len(flights)) or memory.ctypes.data % 64:
        raise ValueError(f"{len(flights)} flights, expected 1 or {lanes()}, with the memory for as many")
    if any(stop - start > flight.pointer.rows for flight in flights):
        raise ValueError(f"{stop - start} steps, expected at most the rows of each history")
    instructions = [*_LANES].index(instruction_set())
    pointers = ffi.new("hsv_flight *[]", [flight.pointer for flight in flights])
    return int(lib.hsv_fly(instructions, len(flights), pointers, ffi.from_buffer(memory), start, stop, halves))


def loop_memory(flights: int) -> np.ndarray:
    """Return aligned memory (bytes) that holds the loop state of ``flights`` flights between calls of :func:`fly`."""
    size = lib.hsv_memory_size(flights)
    room = np.zeros(size + 64, np.uint8)
    start = -room.ctypes.data % 64
    return room[start : start + size]


class Struct:
    """A struct of core.h; its fields are attributes, which also keep alive the arrays to which the struct points."""

    def __init__(self, kind: str, **values: Any) -> None:
        """Fill the struct ``kind``.

        Args:
            kind: Name of the struct in core.h.
            values: Values of the fields by name, without the fields that count elements. An array that the core writes
                to is not copied; a nested struct is a :class:`Struct`.

        Raises:
            ParameterError: A value is missing or has the wrong type or shape; the message names its field.
        """
        vars(self).update(values)
        self.kind = kind
        self.pointer = ffi.new(f"{kind} *")
        counts: dict[str, int] = {}
        for name, declared in _fields(kind).items():
            self._set(name, declared, counts)
        for name, count in counts.items():
            setattr(self.pointer, name, count)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    @property
    def values(self) -> dict[str, Any]:
        """The values of the fields by name."""
        return {name: getattr(self, name) for name in _fields(self.kind)}

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.kind, self.values)

    def __deepcopy__(self, memo: dict[int, Any]) -> Struct:
        """Return a copy that continues from the memory of this one; both share what the core only reads."""
        constant = {name for name, pointer in _pointers(self.kind).items() if pointer.constant}
        copied = {name: value if name in constant else deepcopy(value, memo) for name, value in self.values.items()}
        return Struct(self.kind, **copied)

    def replaced(self, **changes: Any) -> Struct:
        """Return a copy with other values of some fields."""
        return Struct(self.kind, **self.values | changes)

    def _set(self, name: str, declared: Any, counts: dict[str, int]) -> None:
        target = self.pointer
        try:
            value = getattr(self, name)
            if declared.kind == "primitive":
                setattr(target, name, value if declared.cname == "double" else index(value))
            elif declared.kind == "array":
                _copy_array(getattr(target, name), declared, np.asarray(value))
            elif declared.kind == "struct":
                if not isinstance(value, Struct) or value.kind != declared.cname:
                    found = value.kind if isinstance(value, Struct) else type(value).__name__
                    raise TypeError(f"{found}, expected a Struct {declared.cname}")
                ffi.memmove(ffi.addressof(target, name), value.pointer, ffi.sizeof(declared))
            else:
                setattr(target, name, self._address(name, declared, value, counts))
        except (AttributeError, TypeError, ValueError, OverflowError) as error:
            raise ParameterError(f"{self.kind}.{name}: {error}") from error

    def _address(self, name: str, declared: Any, value: Any, counts: dict[str, int]) -> Any:
        pointer = _pointers(self.kind).get(name)  # None for a pointer to a function
        if value is None and (pointer is None or pointer.optional):
            return ffi.NULL
        if isinstance(value, Struct):
            return value.pointer
        if pointer is None or isinstance(value, ffi.CData):
            return value if isinstance(value, ffi.CData) else ffi.cast(declared, value)
        constant, shape, _ = pointer
        element = declared.item.cname
        required = _ELEMENTS.get(element) or dtype(element)
        fits = isinstance(value, np.ndarray) and value.dtype == required and value.flags.c_contiguous
        if not constant and not (fits and value.flags.writeable):
            raise TypeError("expected an array that the core can write to")
        if not fits:
            value = _contiguous(np.asarray(value), required)
            setattr(self, name, value)
        if shape:
            _measure(value.shape, shape, counts)
        return ffi.cast(declared, ffi.from_buffer(value))


def _restored(kind: str, values: dict[str, Any]) -> Struct:
    return Struct(kind, **values)


def _copy_array(target: Any, declared: Any, value: np.ndarray) -> None:
    element, shape = _element(declared)
    if value.shape != shape:
        raise ValueError(f"array of shape {value.shape}, expected {shape}")
    array = _contiguous(value, _ELEMENTS[element])
    ffi.memmove(target, ffi.from_buffer(array), array.nbytes)


def _contiguous(value: np.ndarray, required: np.dtype[Any]) -> np.ndarray:
    """Return ``value`` as a contiguous array of type ``required``; floats instead of integers raise a TypeError."""
    if value.size and not np.can_cast(value.dtype, required, "same_kind"):
        raise TypeError(f"array of {value.dtype}, expected {required}")
    return np.ascontiguousarray(value, required)


def _measure(found: tuple[int, ...], declared: tuple[_Dimension, ...], counts: dict[str, int]) -> None:
    """Add the counts in the shape ``found`` to ``counts``; raise a ValueError if they contradict it or ``declared``."""
    fits = len(found) == len(declared)
    for size, dimension in zip(found, declared, strict=False):
        count = size - dimension.more
        fits = fits and dimension.size in (None, size) and 0 <= count <= (dimension.greatest or count)
        if dimension.counts:
            fits = fits and counts.setdefault(dimension.counts, count) == count
    if not fits:
        known = ", ".join(f"{name} = {count}" for name, count in counts.items())
        expected = ", ".join(dimension.text for dimension in declared)
        raise ValueError(f"array of shape {found}, expected ({expected}){f' with {known}' if known else ''}")


class Callback:
    """A Python function that the core can call as a step function of ``hsv_block.h``, as long as this object lives.

    ``error`` is the exception that the function raised, or None; ``times`` are the durations (s) of all other calls.
    """

    def __init__(self, function: Callable[[int, Any, Any], None]) -> None:
        """Wrap ``function``, which is called with the step k and the pointers to its inputs and outputs."""
        self.function = function
        self.error: BaseException | None = None
        self.times = array("d")
        self._handle = ffi.new_handle(self)
        state = ffi.cast("double *", self._handle)
        self.call = Struct("hsv_call", function=lib.hsv_call_python, state=state, par=None)


def _keep_exception(kind: type[BaseException], error: BaseException, traceback: Any) -> None:
    callback = ffi.from_handle(ffi.cast("void *", traceback.tb_frame.f_locals["state"]))
    callback.error = error


@ffi.def_extern(name="hsv_call_python", error=1, onerror=_keep_exception)
def _call_python(k: int, given: Any, out: Any, state: Any, par: Any) -> int:
    callback = ffi.from_handle(ffi.cast("void *", state))
    begun = perf_counter()
    callback.function(k, given, out)
    callback.times.append(perf_counter() - begun)
    return 0

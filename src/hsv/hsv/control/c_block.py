"""Blocks in C, as ``hsv_block.h`` defines them, read from a shared library.

Loading runs the library's code, which may crash: it is left to a child process, see :mod:`hsv.control.library_process`.
"""

from __future__ import annotations

import ctypes
import re
from ctypes import POINTER, Structure, c_char_p, c_double, c_int64, c_void_p
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import HsvError, ParameterError
from hsv.base.parameters import Parameter
from hsv.base.units import parse_quantity
from hsv.model.signals import SignalType

ABI_VERSION = 1
"""``HSV_BLOCK_ABI_VERSION`` of the header."""

_MOST = 10_000_000
"""Numbers that a signal, a parameter or the state has at most: more are no sizes."""


class _Signal(Structure):
    _fields_ = [("name", c_char_p), ("unit", c_char_p), ("size", c_int64)]


class _Parameter(Structure):
    _fields_ = [
        *((name, c_char_p) for name in ("name", "unit", "description")),
        ("size", c_int64),
        ("value", POINTER(c_double)),
        ("minimum", c_double),
        ("maximum", c_double),
    ]


class _Block(Structure):
    _fields_ = [
        ("abi_version", c_int64),
        ("name", c_char_p),
        ("source", c_char_p),
        ("step", c_void_p),
        ("state_size", c_int64),
        ("input_count", c_int64),
        ("inputs", POINTER(_Signal)),
        ("output_count", c_int64),
        ("outputs", POINTER(_Signal)),
        ("parameter_count", c_int64),
        ("parameters", POINTER(_Parameter)),
    ]


@dataclass(frozen=True)
class CBlock:
    """The description of a block that a library exports, checked."""

    name: str
    source: str
    """Path from the library's folder, empty where none is given"""
    address: int
    """Address of the step function in the process that loaded the library."""
    state_size: int
    inputs: tuple[SignalType, ...]
    outputs: tuple[SignalType, ...]
    parameters: tuple[Parameter, ...]
    """Named ``block.parameter``, in the order in which the step function has their values"""


def include_folder() -> Path:
    """Return the folder of ``hsv_block.h``."""
    return Path(str(files("hsv.control").joinpath("include")))


def load_block(path: Path, symbol: str) -> CBlock:
    """Load a library and return the block that it exports under a symbol.

    Raises:
        ParameterError: It is no library, has no such symbol, or describes no block; the field that is wrong is named.
    """
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        words = str(error).removeprefix(f"{path}: ")
        raise ParameterError(f"cannot be loaded ({words}), expected a shared library") from error
    try:
        found = _Block.in_dll(library, symbol)
    except ValueError:
        raise ParameterError(f"no symbol {symbol!r}, expected a constant of the type hsv_block") from None
    if found.abi_version != ABI_VERSION:
        raise ParameterError(f"abi_version = {found.abi_version}, expected {ABI_VERSION}, as of hsv_block.h")
    if not found.step:
        raise ParameterError("step = NULL, expected a function")
    name = _name(found.name, "name")
    return CBlock(
        name,
        _text(found.source, "source") if found.source else "",
        found.step,
        _size(found.state_size, "state_size", 0),
        _signals(found.input_count, found.inputs, "input"),
        _signals(found.output_count, found.outputs, "output"),
        _parameters(found.parameter_count, found.parameters, name),
    )


def _signals(count: int, signals: Any, kind: str) -> tuple[SignalType, ...]:
    return tuple(
        SignalType(_name(s.name, f"{field}.name"), _text(s.unit, f"{field}.unit"), _size(s.size, f"{field}.size"))
        for field, s in _entries(count, signals, kind)
    )


def _parameters(count: int, parameters: Any, block: str) -> tuple[Parameter, ...]:
    found = []
    for field, given in _entries(count, parameters, "parameter"):
        name, size = _name(given.name, f"{field}.name"), _size(given.size, f"{field}.size")
        if not given.value:
            raise ParameterError(f"{field}.value = NULL, expected {size} numbers")
        values = [float(value) for value in given.value[:size]]
        unit, bounds = _text(given.unit, f"{field}.unit"), (given.minimum, given.maximum)
        try:
            if unit != "1":
                parse_quantity(f"1 {unit}", unit, field)
        except HsvError as error:
            raise ParameterError(f"{field}.unit = {unit!r}, expected an SI unit, 1 where there is none") from error
        parameter = Parameter(
            f"{block}.{name}",
            values if size > 1 else values[0],
            _text(given.description, f"{field}.description"),
            "" if unit == "1" else unit,
            *(bounds if any(bounds) else (-np.inf, np.inf)),
        )
        try:
            parameter.check(parameter.default)
        except ParameterError as error:
            raise ParameterError(f"{field}.value: {error}") from error
        found.append(parameter)
    names = [parameter.name for parameter in found]
    if len(set(names)) < len(names):
        raise ParameterError(f"parameters {', '.join(names)}, expected names that differ")
    return tuple(found)


def _entries(count: int, entries: Any, kind: str) -> list[tuple[str, Any]]:
    _size(count, f"{kind}_count", 0)
    if count and not entries:
        raise ParameterError(f"{kind}s = NULL, expected {count} of them")
    return [(f"{kind}s[{index}]", entries[index]) for index in range(count)]


def _size(value: int, field: str, least: int = 1) -> int:
    if not least <= value <= _MOST:
        raise ParameterError(f"{field} = {value}, expected {least} to {_MOST}")
    return value


def _name(value: bytes | None, field: str) -> str:
    text = _text(value, field)
    if not re.fullmatch(r"[A-Za-z_]\w*", text, re.ASCII):
        raise ParameterError(f"{field} = {text!r}, expected letters, digits and underscores")
    return text


def _text(value: bytes | None, field: str) -> str:
    try:
        return (value or b"").decode()
    except UnicodeDecodeError:
        raise ParameterError(f"{field} = {value!r}, expected text in UTF-8") from None

"""Controllers in C: ``controller = "path/lib.so:symbol"``, where the symbol is a block of ``hsv_block.h``.

A library may crash, so a child process loads and steps it, see :mod:`hsv.plugins.library_process`.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import sys
from collections.abc import Mapping
from ctypes import POINTER, Structure, c_char_p, c_double, c_int64, c_void_p
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from hsv.base.errors import ControllerError, DocumentError, HsvError, ParameterError, ProcessError, reason
from hsv.base.files import read_bytes
from hsv.base.parameters import Parameter, validate
from hsv.base.units import parse_quantity
from hsv.control.controller import (
    CONTROLLER_INPUTS,
    CONTROLLER_OUTPUTS,
    ControllerInput,
    ExternalController,
    StepKernel,
    flat_input,
)
from hsv.control.notch_filter import NotchFilter
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import N_INPUTS, SignalType
from hsv.model.vehicle import Vehicle
from hsv.plugins.library_answers import CBlock
from hsv.plugins.library_process import library_user

ABI_VERSION = 1
"""``HSV_BLOCK_ABI_VERSION`` of the header"""

_MOST = 10_000_000
"""Maximum size of a signal, a parameter or the state"""


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


def include_folder() -> Path:
    """Return the folder that contains ``hsv_block.h``."""
    return Path(str(files("hsv.plugins").joinpath("include")))


def load_block(path: Path, symbol: str) -> CBlock:
    """Load the library at ``path`` into this process and return the block that it exports as ``symbol``.

    Raises:
        ParameterError: It is not a library, has no such symbol, or a field of the block is wrong (and is named).
    """
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        words = str(error).removeprefix(f"{path}: ")
        raise ParameterError(f"cannot be loaded ({words}), expected a shared library") from error
    try:
        found = _Block.in_dll(library, symbol)
    except ValueError:
        mangled = re.search(
            rf"_Z[0-9A-Za-z_]*?{len(symbol)}{re.escape(symbol)}E?", path.read_bytes().decode("latin-1"), re.ASCII
        )
        words = f", but {mangled[0]} as C++ names it: HSV_BLOCK({symbol}) = {{...}} exports it" if mangled else ""
        raise ParameterError(f"no symbol {symbol!r}{words}, expected a constant of the type hsv_block") from None
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
        SignalType(_name(s.name, f"{field}.name"), _text(s.unit, f"{field}.unit"), _size(s.size, f"{field}.size", 0))
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


def library_place(controller: str) -> tuple[Path, str] | None:
    """Return path and symbol of a controller in a shared library, or path and "" of one in an FMU; None for others."""
    if controller.lower().endswith(".fmu"):
        return Path(controller), ""
    path, _, symbol = controller.rpartition(":")
    return (Path(path), symbol) if "/" in path or path.endswith(".so") else None


def inside(controller: str, folder: Path) -> str:
    """Return the ``controller`` of a scenario file in ``folder``, with the path of a library or FMU made absolute.

    Raises:
        ParameterError: The path leads out of the folder of the scenario.
    """
    place = library_place(controller)
    if place is None:
        return controller
    path, symbol = place
    found = (folder / path).resolve()
    if not found.is_relative_to(folder.resolve()):
        raise ParameterError(f"controller = {controller!r}: expected a path inside the scenario's folder")
    return f"{found}:{symbol}" if symbol else str(found)


def find_in(folder: Path, controller: str) -> None:
    """Let Python find the module of a scenario's ``controller`` in its ``folder``, if it is there, after all others.

    This holds for processes that are started later, too. Nothing is loaded here.
    """
    module = controller.partition(":")[0].partition(".")[0]
    place = str(folder.resolve())
    there = module.isidentifier() and ((folder / f"{module}.py").is_file() or (folder / module).is_dir())
    if there and library_place(controller) is None and ":" in controller and place not in sys.path:
        sys.path.append(place)
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (os.environ.get("PYTHONPATH"), place)))


def seen_from(controller: str, folder: Path) -> str:
    """Return ``controller`` for a scenario in ``folder``: the path of a library or FMU inside it is made relative."""
    place = library_place(controller)
    if place is None or not place[0].is_relative_to(folder.resolve()):
        return controller
    return f"./{controller.removeprefix(f'{folder.resolve()}/')}"


def library_digest(controller: str) -> str:
    """Return the SHA-256, in hexadecimal, of the library or FMU of a scenario's ``controller``; empty for others.

    Raises:
        ParameterError: The file cannot be read.
    """
    place = library_place(controller)
    if place is None:
        return ""
    try:
        return hashlib.sha256(read_bytes(place[0])).hexdigest()
    except DocumentError as error:
        raise ParameterError(f"controller = {controller!r}: {error}") from error


class LibraryClass:
    """Class-like object for a controller in a shared library, see :class:`hsv.control.controller.ControllerClass`."""

    def __init__(self, name: str, path: Path, symbol: str) -> None:
        """Read the description of the block ``symbol`` in the library at ``path``; ``name`` is for error messages.

        Raises:
            ParameterError: There is no such library or block, or the block is not a controller.
        """
        self._name, self._path, self._symbol = name, path, symbol
        try:
            self.block: CBlock = library_user(path).describe(symbol)
            self._check()
        except OSError as error:
            words = f"cannot be read ({reason(error)}), expected {'a shared library' if symbol else 'an FMU'}"
            raise ParameterError(f"controller = {name!r}: {words}") from error
        except ProcessError as error:
            raise ParameterError(f"controller = {name!r}: {error} while it was loaded") from error
        except HsvError as error:
            raise ParameterError(f"controller = {name!r}: {error}") from error

    def _check(self) -> None:
        """Refuse a block whose inputs and outputs are not those of a controller; otherwise adopt its parameters.

        The last inputs of :data:`CONTROLLER_INPUTS` may be missing.
        """
        # The size of the last input is that of the notch filter.
        size = self.block.inputs[-1].size if self.block.inputs else 0
        _check_signals("inputs", self.block.inputs, _inputs(size)[: len(self.block.inputs)])
        _check_signals("outputs", self.block.outputs, CONTROLLER_OUTPUTS)
        self.PARAMETERS = self.block.parameters

    def from_parameters(self, values: Mapping[str, Any], design: object) -> LibraryController:
        """Return the controller for a flight with the flat parameters ``values``; ``design`` is not used.

        Raises:
            ParameterError: A parameter is wrong, or the block expects another number of notch filter states.
        """
        own = validate(self.PARAMETERS, values)
        for parameter in self.PARAMETERS:
            if np.size(own[parameter.name]) != np.size(parameter.default):
                raise ParameterError(
                    f"{parameter.name}: {np.size(own[parameter.name])} numbers, expected {np.size(parameter.default)}"
                )
        if len(self.block.inputs) == len(CONTROLLER_INPUTS):
            states = 2 * len(NotchFilter.from_parameters(values).sections)
            _check_signals("inputs", self.block.inputs, _inputs(states))
        numbers = np.concatenate([np.ravel(own[parameter.name]) for parameter in self.PARAMETERS] or [np.zeros(0)])
        vehicle = Vehicle.from_parameters(values).decoupled
        return LibraryController(self._name, self._path, self._symbol, self.block.state_size, numbers, vehicle)


def _inputs(filter_states: int) -> tuple[SignalType, ...]:
    """Return the inputs of a controller in a flight whose notch filter has ``filter_states`` states."""
    return (*CONTROLLER_INPUTS[:-1], replace(CONTROLLER_INPUTS[-1], size=filter_states))


def _check_signals(field: str, found: tuple[SignalType, ...], expected: tuple[SignalType, ...]) -> None:
    for index, (signal, other) in enumerate(zip(found, expected, strict=False)):
        if signal != other:
            raise ParameterError(f"{field}[{index}] = {_words(signal)}, expected {_words(other)}")
    if len(found) != len(expected):
        raise ParameterError(f"{len(found)} {field}, expected {', '.join(signal.name for signal in expected)}")


def _words(signal: SignalType) -> str:
    return f"{signal.name}, {signal.size} in {signal.unit!r}"


class LibraryController(ExternalController):
    """A controller in a shared library or FMU, whose function a child process calls."""

    def __init__(
        self, name: str, path: Path, symbol: str, state_size: int, parameters: np.ndarray, vehicle: VehicleParameters
    ) -> None:
        super().__init__(name, None, vehicle)
        self.path, self.symbol, self.parameters = path, symbol, parameters
        self._state = np.zeros(state_size)

    @property
    def library(self) -> Any:
        """The child process of the library, or the library itself if this process is the child."""
        return library_user(self.path)

    def loaded(self, address: int) -> ExternalController:
        """Return a controller for the process that has loaded the library, with its step function at ``address``."""
        kernel = StepKernel(address, np.zeros_like(self._state), self.parameters)
        return ExternalController(self.name, SimpleNamespace(kernel=kernel), self.vehicle)

    def reset(self) -> None:
        """Set the state of the controller to zero before a new flight."""
        self._state = np.zeros_like(self._state)

    def _call(self, inputs: ControllerInput) -> Any:
        call = self.symbol, inputs.step, flat_input(inputs), self._state, self.parameters
        try:
            answer = self.library.request("step", np.ndarray, *call)
            if answer.shape != (N_INPUTS + len(self._state),):
                raise ProcessError("wrote an answer of its own")
        except ProcessError as error:
            raise ControllerError(f"{self.name}, step {inputs.step}: {error}") from error
        self._state = answer[N_INPUTS:]
        return answer[:N_INPUTS]

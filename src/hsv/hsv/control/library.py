"""Controllers in C: ``controller = "path/lib.so:symbol"``, the symbol a block of ``hsv_block.h``.

This process never loads the library: it is described, stepped and flown by a child, see
:mod:`hsv.control.library_process`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from hsv.base.documents import read_bytes
from hsv.base.errors import ControllerError, DocumentError, HsvError, ParameterError, ProcessError, reason
from hsv.base.parameters import check_all
from hsv.control.c_block import CBlock
from hsv.control.controller import (
    CONTROLLER_INPUTS,
    CONTROLLER_OUTPUTS,
    ControllerInput,
    ForeignController,
    StepKernel,
    flat_input,
)
from hsv.control.library_process import LibraryUser, library_user
from hsv.control.notch_filter import NotchFilter
from hsv.model.signals import SignalType
from hsv.model.vehicle import Vehicle
from hsv.model.vehicle_parameters import VehicleParameters


def library_place(controller: str) -> tuple[Path, str] | None:
    """Return path and symbol of a controller in a shared library, nothing where it is another one."""
    path, _, symbol = controller.rpartition(":")
    return (Path(path), symbol) if "/" in path or path.endswith(".so") else None


def inside(controller: str, folder: Path) -> str:
    """Return the ``controller`` of a scenario in ``folder``, the path of a library absolute.

    Raises:
        ParameterError: The path leads out of the folder: a scenario names nothing but what comes with it.
    """
    place = library_place(controller)
    if place is None:
        return controller
    path, symbol = place
    found = (folder / path).resolve()
    if not found.is_relative_to(folder.resolve()):
        raise ParameterError(f"controller = {controller!r}: expected a path inside the scenario's folder")
    return f"{found}:{symbol}"


def seen_from(controller: str, folder: Path) -> str:
    """Return the ``controller`` as a scenario in ``folder`` names it; a library elsewhere keeps its absolute path."""
    place = library_place(controller)
    if place is None or not place[0].is_relative_to(folder.resolve()):
        return controller
    return f"./{place[0].relative_to(folder.resolve())}:{place[1]}"


@dataclass(frozen=True)
class LibraryRecord:
    """Data about a controller library that are stored with a recorded flight."""

    sha256: str
    """SHA-256 of the file, hexadecimal."""
    source_name: str
    """Path of the source, as given by the block, relative to the library's folder; empty if unknown or missing."""
    source: bytes


def library_record(controller: str) -> LibraryRecord | None:
    """Return the data to store for a scenario's ``controller``; nothing if it is not in a library.

    Raises:
        ParameterError: The library cannot be read.
    """
    place = library_place(controller)
    if place is None:
        return None
    path, symbol = place
    name, source = LibraryClass(controller, path, symbol).block.source, b""
    if name:
        try:
            source = (path.parent / name).read_bytes()
        except OSError:
            name = ""  # A library flies without its source, wherever it is flown.
    return LibraryRecord(library_digest(controller), name, source)


def library_digest(controller: str) -> str:
    """Return the SHA-256 of the library of a scenario's ``controller``, hexadecimal; empty where it is in none.

    Raises:
        ParameterError: It cannot be read.
    """
    place = library_place(controller)
    if place is None:
        return ""
    try:
        return hashlib.sha256(read_bytes(place[0])).hexdigest()
    except DocumentError as error:
        raise ParameterError(f"controller = {controller!r}: {error}") from error


class LibraryClass:
    """The class of a controller in a shared library, see :class:`hsv.control.controller.ControllerClass`."""

    def __init__(self, name: str, path: Path, symbol: str) -> None:
        """Describe the controller ``name``, which is the block under a ``symbol`` of the library.

        Raises:
            ParameterError: There is no such library or block, or it is no controller; the field is named.
        """
        self._name, self._path, self._symbol = name, path, symbol
        try:
            self.block: CBlock = library_user(path).describe(symbol)
            # The size of the last one is that of the notch filter it is flown with.
            size = self.block.inputs[-1].size if self.block.inputs else 0
            _check_signals("inputs", self.block.inputs, _inputs(size)[: len(self.block.inputs)])
            _check_signals("outputs", self.block.outputs, CONTROLLER_OUTPUTS)
        except OSError as error:
            raise ParameterError(
                f"controller = {name!r}: cannot be read ({reason(error)}), expected a shared library"
            ) from error
        except ProcessError as error:
            raise ParameterError(f"controller = {name!r}: {error} while it was loaded") from error
        except HsvError as error:
            raise ParameterError(f"controller = {name!r}: {error}") from error
        self.PARAMETERS = self.block.parameters

    def from_parameters(self, values: Mapping[str, Any], design: object) -> LibraryController:
        """Return the controller.

        Raises:
            ParameterError: A parameter has another size, or the notch filter has, that is flown.
        """
        own = check_all(self.PARAMETERS, values)
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
    """Return what a controller is given beside a notch filter with so many states."""
    return (*CONTROLLER_INPUTS[:-1], CONTROLLER_INPUTS[-1].of_size(filter_states))


def _check_signals(field: str, found: tuple[SignalType, ...], expected: tuple[SignalType, ...]) -> None:
    for index, (signal, other) in enumerate(zip(found, expected, strict=False)):
        if signal != other:
            raise ParameterError(f"{field}[{index}] = {_words(signal)}, expected {_words(other)}")
    if len(found) != len(expected):
        raise ParameterError(f"{len(found)} {field}, expected {', '.join(signal.name for signal in expected)}")


def _words(signal: SignalType) -> str:
    return f"{signal.name}, {signal.size} in {signal.unit!r}"


class LibraryController(ForeignController):
    """A controller in a shared library. In flight as in single steps, its function is called by the child process."""

    def __init__(
        self,
        name: str,
        path: Path,
        symbol: str,
        state_size: int,
        parameters: np.ndarray,
        vehicle: VehicleParameters,
    ) -> None:
        super().__init__(name, None, vehicle)
        self.path, self.symbol, self.parameters = path, symbol, parameters
        self._state = np.zeros(state_size)

    @property
    def library(self) -> LibraryUser:
        """The user of the library."""
        return library_user(self.path)

    def loaded(self, address: int) -> ForeignController:
        """Return the same where the library is loaded, with its function at an address."""
        kernel = StepKernel(address, np.zeros_like(self._state), self.parameters)
        return ForeignController(self.name, SimpleNamespace(kernel=kernel), self.vehicle)

    def reset(self) -> None:
        """Start a new run."""
        self._state = np.zeros_like(self._state)

    def _answer(self, inputs: ControllerInput) -> Any:
        call = self.symbol, inputs.step, flat_input(inputs), self._state, self.parameters
        try:
            wanted, self._state = self.library.request("step", *call)
        except ProcessError as error:
            raise ControllerError(f"{self.name}, step {inputs.step}: {error}") from error
        return wanted

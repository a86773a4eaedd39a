"""Exported blocks, compiled, in the places of those of the loop."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np

from hsv.control.controller import STEP_FUNCTION, Controller, ControllerInput, ControllerResult, flat_input
from hsv.control.design import ControlDesign
from hsv.control.export import SOURCE, controller_files
from hsv.control.library import load_block
from hsv.control.nominal_trajectory import NominalResult
from hsv.control.notch_filter import NotchResult
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.flight.closed_loop import Components

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off")


def write_source(design: ControlDesign, folder: Path) -> Path:
    """Write the exported files into ``folder``; return the path of the source."""
    for name, text in controller_files(design).items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / SOURCE


def compile_library(design: ControlDesign, folder: Path, compiler: str = "cc") -> Path:
    """Return the shared library of the exported ``design``, in ``folder``."""
    source, library = write_source(design, folder), folder / "controller.so"
    command = [compiler, *FLAGS, "-O3", "-shared", "-fPIC", "-o", str(library), str(source)]
    subprocess.run(command, check=True, capture_output=True)
    return library


class ExportedBlock:
    """A block of a library, stepped from 0 on."""

    def __init__(self, library: Path, symbol: str) -> None:
        self._description = load_block(library, symbol)
        self._function = STEP_FUNCTION(self._description.address)
        self.reset()

    def reset(self) -> None:
        self._state, self._next = np.zeros(self._description.state_size), 0

    def call(self, given: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the outputs of the next step."""
        given = np.ascontiguousarray(given[: sum(signal.size for signal in self._description.inputs)], float)
        out = np.full(sum(signal.size for signal in self._description.outputs), np.nan)
        arrays = (given, out, self._state, parameters)
        assert self._function(self._next, *(array.ctypes.data for array in arrays)) == 0
        self._next += 1
        return out


class ExportedNotchFilter(ExportedBlock):
    """As :class:`hsv.control.notch_filter.NotchFilter`."""

    estimator = None

    def __init__(self, library: Path) -> None:
        super().__init__(library, "notch_filter")

    def step(self, pitch_rate: float) -> NotchResult:
        filtered, *state = self.call(np.array([pitch_rate]), np.empty(0))
        return NotchResult(filtered, np.array(state))


class ExportedNominalTrajectory(ExportedBlock):
    """As :class:`hsv.control.nominal_trajectory.NominalTrajectory`."""

    def __init__(self, library: Path, reference: ReferenceTrajectory) -> None:
        super().__init__(library, "nominal_trajectory")
        self.reference = reference

    def step(self, state: np.ndarray) -> NominalResult:
        data, row = self.reference.data, self.reference.row(self._next)
        x_r, u_r, d_r = data.state[row], data.input[row], data.defect[row]
        out = self.call(np.concatenate((state, x_r, d_r)), np.empty(0))
        return NominalResult(x_r, u_r, out[:9], out[9:11], np.empty(0), int(out[11]), int(out[12]))


class ExportedTubeLaw(ExportedBlock, Controller):
    """As :class:`hsv.control.tube_law.TubeLaw`; the wanted input is limited here."""

    def __init__(self, library: Path, parameters: np.ndarray, minimum: np.ndarray, maximum: np.ndarray) -> None:
        super().__init__(library, "tube_law")
        self._parameters, self._minimum, self._maximum = parameters, minimum, maximum

    def step(self, inputs: ControllerInput) -> ControllerResult:
        wanted = self.call(flat_input(inputs), self._parameters)
        return ControllerResult(np.clip(wanted, self._minimum, self._maximum), wanted)


def with_exported_blocks(parts: Components, folder: Path) -> Components:
    """Return the loop of a tube law with its three blocks as they are exported, built in ``folder``."""
    law, reference = parts.controller, parts.nominal_trajectory.reference
    library = compile_library(law.design, folder)
    parameters = np.array([*law.design.tau, law.kernel.integral_rate])
    return replace(
        parts,
        notch_filter=ExportedNotchFilter(library),
        nominal_trajectory=ExportedNominalTrajectory(library, reference),
        controller=ExportedTubeLaw(library, parameters, law.kernel.minimum, law.kernel.maximum),
    )

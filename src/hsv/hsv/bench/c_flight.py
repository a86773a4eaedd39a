"""The in-process flight as a C program: compiled on the spot, flown through ctypes."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from ctypes import POINTER, Structure, c_double, c_int64
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from hsv.control.c_block import include_folder
from hsv.control.nominal_law import FamilyLaw
from hsv.control.tube_law import TubeLaw
from hsv.errors import RunError
from hsv.export.controller import SOURCE, controller_source
from hsv.faults.laws import CHANNEL, CODE, OCCURRENCE, PARAMETER, START, STOP, FaultRows
from hsv.faults.table import COMMAND, LOSS
from hsv.simulation.closed_loop import Components
from hsv.simulation.history import History

FLAGS = ("-O3", "-ffp-contract=off")
"""No contraction: a fused multiply-add rounds once where the compiled loop rounds twice."""

_Doubles, _Integers = POINTER(c_double), POINTER(c_int64)


class _Tube(Structure):
    _fields_ = [
        ("rows", c_int64),
        ("size", c_int64),
        ("starts", _Integers),
        *((name, _Doubles) for name in ("parameters", "minimum", "maximum")),
    ]


class _Faults(Structure):
    _fields_ = [
        ("count", c_int64),
        *((name, _Integers) for name in ("start", "stop", "channel")),
        ("effectiveness", _Doubles),
    ]


class _Reference(Structure):
    _fields_ = [("first", c_int64), ("rows", c_int64), *((name, _Doubles) for name in ("state", "input", "defect"))]


class _History(Structure):
    _fields_ = [("rows", c_int64), ("flown", _Doubles), ("beside", _Doubles)]


def _losses(components: Components) -> FaultRows:
    """Return the losses of effectiveness, all that the C build knows of what is not ideal.

    Raises:
        RunError: There is more.
    """
    plant, known = components.plant, components.fault_injector.known
    data = plant.data
    linked = data.late == 0.0 and data.link.ideal and components.fault_injector.link.ideal
    if not (data.actuators.ideal and data.atmosphere.still and data.sensors.ideal and linked):
        raise RunError("C build: actuators, air, sensors and links are ideal in it, expected a scenario with these")
    rows = components.fault_injector.rows((COMMAND,))
    others = len(rows.table) < len(known) or np.any(rows.table[:, CODE] != LOSS)
    if others or rows.table[:, OCCURRENCE].any() or rows.table[:, PARAMETER + 1].any():
        raise RunError("C build: a fault that it does not know, expected a loss of effectiveness, at once and for good")
    return rows


class CFlight:
    """The flight of ``components`` by the C build; the tube law over the nested family, as it is exported."""

    def __init__(self, components: Components, flags: Sequence[str] = FLAGS) -> None:
        """Compile and bind.

        Raises:
            RunError: No C compiler, a failed build, or components that the C build does not know.
        """
        law, nominal = components.controller, components.nominal_trajectory
        if not (isinstance(law, TubeLaw) and isinstance(nominal.law, FamilyLaw)):
            raise RunError("C build: it flies the tube law over the nested family, expected a scenario with these")
        if law.kernel.effectiveness is not None:
            raise RunError("C build: effectiveness.enabled = true, expected false: the C code has no estimator of it")
        sections = components.notch_filter.sections
        if law.design.filtered and not sections:
            raise RunError("C build: nominal.filtered without a notch filter in the loop, expected one")
        self._folder = tempfile.TemporaryDirectory(prefix="hsv_bench_")
        source = controller_source(law.design, sections)
        with as_file(files("hsv.bench").joinpath("flight.c")) as flight:
            library = compiled(Path(self._folder.name), source, flags, [flight])
        self._library = ctypes.CDLL(str(library))
        self._library.fly.restype = c_int64
        self._kept: list[np.ndarray] = []
        plant, tube = components.plant, law.kernel
        reference, faults = nominal.reference.data, _losses(components)
        parameters = np.array([[*tau, tube.integral_rate] for _, tau in law.factors])
        self._initial = plant.initial.state
        self._rows = plant.steps + 1
        self._arguments: list[Any] = [
            ctypes.byref((c_double * len(plant.vehicle))(*plant.vehicle)),
            c_double(plant.period),
            c_int64(plant.data.substeps),
            c_double(plant.vehicle.angle_limit),
            c_int64(len(sections)),
            ctypes.byref(
                _Tube(
                    *parameters.shape,
                    self._integers(tube.starts),
                    *(self._doubles(a) for a in (parameters, tube.minimum, tube.maximum)),
                )
            ),
            ctypes.byref(
                _Faults(
                    len(faults.table),
                    *(self._integers(faults.table[:, column].astype(np.int64)) for column in (START, STOP, CHANNEL)),
                    self._doubles(np.ascontiguousarray(faults.table[:, PARAMETER])),
                )
            ),
            ctypes.byref(_Reference(reference.first, len(reference.state), *map(self._doubles, reference[1:]))),
        ]

    def fly(self) -> History:
        """Return what happened, to compare with the history of the compiled loop."""
        history = History.empty(self._rows, estimated=False)
        x = self._initial.copy()
        outputs = _History(self._rows, *(matrix.ctypes.data_as(_Doubles) for matrix in history[:2]))
        rows = self._library.fly(*self._arguments, x.ctypes.data_as(_Doubles), ctypes.byref(outputs))
        return history.cut(rows)

    def _doubles(self, values: np.ndarray) -> Any:
        return self._pointer(values, np.float64, _Doubles)

    def _integers(self, values: np.ndarray) -> Any:
        return self._pointer(values, np.int64, _Integers)

    def _pointer(self, values: np.ndarray, kind: type, pointer: Any) -> Any:
        # The C structures hold addresses only: what they point to must live as long as this object.
        self._kept.append(np.ascontiguousarray(values, kind))
        return self._kept[-1].ctypes.data_as(pointer)


def compiled(folder: Path, controller: str, flags: Sequence[str] = FLAGS, others: Sequence[Path] = ()) -> Path:
    """Return the library in ``folder`` that the source of an exported controller and ``others`` are compiled to.

    Raises:
        RunError: No C compiler, or a failed build.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        raise RunError("C build: no C compiler cc on PATH, expected one (sudo apt-get install gcc)")
    library, source = folder / "flight.so", folder / SOURCE
    source.write_text(controller, encoding="utf-8")
    names = [f"-I{include_folder()}", "-o", str(library), *map(str, others), str(source), "-lm"]
    command = [compiler, *flags, "-std=c99", "-shared", "-fPIC", *names]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise RunError(f"C build: {' '.join(command)} failed: {result.stderr.strip().splitlines()[-1:]}")
    return library


def largest_difference(a: History, b: History) -> float:
    """Return the largest |a - b| / max(1, |a|, |b|) over two histories, 0 where all bits agree.

    Infinity where they differ in length, or one has a number where the other has none.
    """
    largest = 0.0
    for x, y in zip(a.columns().values(), b.columns().values(), strict=True):
        if x.shape != y.shape:
            return float("inf")
        if x.tobytes() == y.tobytes():
            continue
        scale = np.maximum(1.0, np.maximum(np.abs(x), np.abs(y)))
        difference = np.abs(x - y) / scale
        # Zeros of either sign differ, too.
        largest = max(
            largest, np.nextafter(0.0, 1.0), float(np.max(np.where(np.isnan(difference), np.inf, difference)))
        )
    return largest

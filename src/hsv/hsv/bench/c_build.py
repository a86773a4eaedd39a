"""C compiled during the measurement with the best flags: the loop of a single flight, and exported controllers."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path

from hsv.base.errors import RunError
from hsv.core import ffi, loop_memory
from hsv.flight.closed_loop import Components, flight_struct
from hsv.flight.history import History

FLAGS = ("-O3", "-march=native", "-fno-math-errno", "-ffp-contract=off")
"""No contraction: a fused multiply-add rounds once where the core rounds twice."""


def c_flight(components: Components) -> Callable[[], History]:
    """Return a function that flies ``components``, whose equipment is ideal, by the core's sources for one flight.

    They are compiled for this processor. The function returns the history, which its next flight overwrites.

    Raises:
        RunError: There is no C compiler, or the build failed.
    """
    core = Path(str(files("hsv.core")))
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        library = compiled(Path(folder, "flight.so"), [core / "scalar.c", core / "complex.c"], "gnu99")
        loop = ctypes.CDLL(str(library)).hsv_fly_single
    loop.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64]
    history = History.empty(components.plant.steps + 1, estimated=False)
    flight, memory = flight_struct(components, history), loop_memory(1)

    def fly() -> History:
        flights = ffi.new("hsv_flight *[]", [flight.pointer])
        loop(int(ffi.cast("intptr_t", flights)), memory.ctypes.data, 0, len(history.flown))
        return history

    return fly


def compiled(library: Path, sources: Sequence[Path], standard: str = "c99") -> Path:
    """Return the shared ``library``, compiled from ``sources``.

    Raises:
        RunError: There is no C compiler, or the build failed.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        raise RunError("C build: no C compiler cc on PATH, expected one (sudo apt-get install gcc)")
    command = [compiler, f"-std={standard}", *FLAGS, "-shared", "-fPIC", "-o", str(library), *map(str, sources)]
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode:
        raise RunError(f"C build: {' '.join(command)} failed: {result.stderr.strip().splitlines()[-1:]}")
    return library

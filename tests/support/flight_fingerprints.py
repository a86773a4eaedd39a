"""A program that flies scenarios and prints, as JSON, their fingerprints and the software and processor used.

All kinds of interpreters, emulated ones too, run it as ``python -S``: packages of the project's environment start
Python again, and under an emulator this second Python would be native.
"""

from __future__ import annotations

import hashlib
import json
import math
import platform
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from hsv.core import _core, instruction_set
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

try:
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
except ModuleNotFoundError:  # numpy 1.26
    from numpy.core._multiarray_umath import __cpu_dispatch__, __cpu_features__


def flown_on() -> dict[str, Any]:
    """Return versions, processor, and bits computed by libm and BLAS: flights must not depend on any of them."""
    points = np.linspace(0.1, 3.0, 2000)
    libm = [function(x) for function in (math.sin, math.cos, math.tan, math.exp, math.log) for x in points]
    matrix = np.sin(np.arange(64.0 * 64.0)).reshape(64, 64)
    return {
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "instruction set": instruction_set(),
        "compiler": "clang" if b"clang version" in Path(_core.__file__).read_bytes() else "gcc",
        "numpy dispatches to": [name for name in __cpu_dispatch__ if __cpu_features__[name]],
        "libm": hashlib.sha256(np.array(libm).tobytes()).hexdigest(),
        "blas": hashlib.sha256((matrix @ matrix).tobytes()).hexdigest(),
    }


def main(scenarios: list[str]) -> None:
    """Fly ``scenarios`` and print the results."""
    fingerprints, seconds = {}, {}
    for name in scenarios:
        start = time.process_time()
        flight = fly(assemble_flight(load_scenario(name)))
        assert flight.metrics  # the metrics of a flight must be computable there, too
        fingerprints[name] = flight.fingerprint
        seconds[name] = round(time.process_time() - start, 2)
    json.dump({"flown on": flown_on(), "fingerprints": fingerprints, "seconds": seconds}, sys.stdout, indent=1)


if __name__ == "__main__":
    main(sys.argv[1:])

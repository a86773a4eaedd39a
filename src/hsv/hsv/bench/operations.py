"""Count of the arithmetic of a flight: the loop is interpreted with numbers that record what is computed from them.

It runs in a Python of its own, ``python -m hsv.bench.operations``, in which numba compiles nothing.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from hsv.errors import RunError
from hsv.simulation import closed_loop
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.history import History
from hsv.simulation.scenario import load_scenario

_FEW, _MANY = 10, 20
"""Control periods of the flights whose difference is counted, so that what is computed once a flight is not."""

_ARITHMETIC = (np.add, np.subtract, np.multiply, np.divide, np.sqrt)


def operations_per_step() -> int:
    """Return how many additions, subtractions, multiplications, divisions and roots a step of Case 1 needs.

    An operation that is written twice with the same operands counts once, as a compiler keeps its result; one whose
    operands are the same in all steps does not count. Comparisons, signs and what moves data are left out.

    Raises:
        RunError: The flight could not be counted.
    """
    counted = subprocess.run(
        [sys.executable, "-m", "hsv.bench.operations"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    if counted.returncode:
        raise RunError(f"operations of a step: cannot be counted: {(counted.stderr.strip() or '?').splitlines()[-1]}")
    return int(counted.stdout)


class Counted(float):
    """A number whose arithmetic gives numbers of its kind, each operation with the same operands the same one."""

    done: ClassVar[dict[tuple[object, ...], tuple[Counted, tuple[float, ...]]]] = {}
    """Result and operands of each operation. Operands are told apart by identity, and so must be kept."""

    def __array_ufunc__(self, function: Any, method: str, *operands: float) -> Counted:
        """Take part in what numpy computes of single numbers."""
        return _computed(function, *operands)


def _computed(function: Callable[..., Any], *operands: float) -> Counted:
    key = (function, *(id(value) if isinstance(value, Counted) else (float(value),) for value in operands))
    if key not in Counted.done:
        Counted.done[key] = Counted(function(*map(float, operands))), operands
    return Counted.done[key][0]


for _name, _function in (("add", np.add), ("sub", np.subtract), ("mul", np.multiply), ("truediv", np.divide)):
    setattr(Counted, f"__{_name}__", lambda a, b, function=_function: _computed(function, a, b))
    setattr(Counted, f"__r{_name}__", lambda a, b, function=_function: _computed(function, b, a))
for _name, _moving in (("neg", np.negative), ("abs", np.fabs)):
    setattr(Counted, f"__{_name}__", lambda a, function=_moving: _computed(function, a))


def counting(value: Any) -> Any:
    """Return ``value``, an argument of a function in flight, with every number in it counted; histories are kept."""
    if isinstance(value, float):
        return Counted(value)
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        counted = np.empty(value.shape, object)
        for index, number in np.ndenumerate(value):
            counted[index] = Counted(number)
        return counted
    if isinstance(value, tuple) and not isinstance(value, History):
        numbers = [counting(number) for number in value]
        return value._make(numbers) if hasattr(value, "_make") else tuple(numbers)
    return value


def count(steps: int) -> tuple[int, str]:
    """Return the operations of the first ``steps`` control periods of Case 1, interpreted, and their fingerprint."""
    parameters = flight_parameters(load_scenario("case1"))
    period = assemble(parameters).plant.period
    fly_loop = closed_loop.fly_loop
    Counted.done.clear()
    try:
        closed_loop.fly_loop = lambda *given: fly_loop(*map(counting, given))
        flight = closed_loop.fly(assemble(parameters | {"duration": steps * period}))
    finally:
        closed_loop.fly_loop = fly_loop
    return sum(key[0] in _ARITHMETIC for key in Counted.done), flight.fingerprint


if __name__ == "__main__":
    print((count(_MANY)[0] - count(_FEW)[0]) // (_MANY - _FEW))

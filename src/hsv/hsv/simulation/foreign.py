"""Blocks of the loop that are not of this library, called from the compiled loop by address, as C functions.

All have one signature, ``int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)``;
anything but 0 ends the flight.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from hsv.control.controller import STEP_FUNCTION

NOTHING = 0
"""Placeholder for an address: the built-in law, compiled with the loop, is flown."""


class Call(NamedTuple):
    """Addresses of a step function and of its four arrays."""

    function: int
    inputs: int
    outputs: int
    state: int
    parameters: int


NO_CALL = Call(NOTHING, NOTHING, NOTHING, NOTHING, NOTHING)


@intrinsic
def _call_step(typing_context: Any, function: Any, step: Any, inputs: Any, outputs: Any, state: Any, par: Any) -> Any:
    """Call the step function at an address (int64), with addresses of its arrays, and return what it returns."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointer = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.IntType(32), [ir.IntType(64), *[pointer] * 4])
        address, number, *arrays = arguments
        pointers = [builder.inttoptr(array, pointer) for array in arrays]
        return builder.call(builder.inttoptr(address, kind.as_pointer()), [number, *pointers])

    return types.int32(*[types.int64] * 6), generate


call_step: Any = _call_step
"""Function for compiled code, without the first argument, which numba supplies."""


def call_of(function: int, inputs: np.ndarray, outputs: np.ndarray, state: np.ndarray, par: np.ndarray) -> Call:
    """Return the call of the function at an address with these arrays, which must live as long as it is used."""
    return Call(function, *(array.ctypes.data for array in (inputs, outputs, state, par)))


class Callback:
    """A Python function of the step at an address, for as long as this object lives; keeps what it raises.

    It reads and writes the arrays of the call in place.
    """

    def __init__(self, function: Callable[[int], None]) -> None:
        self._function = function
        self.error: BaseException | None = None
        self._called = STEP_FUNCTION(self._call)
        self.call = NO_CALL._replace(function=ctypes.cast(self._called, ctypes.c_void_p).value or NOTHING)

    def _call(self, step: int, *_: object) -> int:
        # An exception must not pass through compiled code.
        try:
            self._function(step)
        except BaseException as error:
            self.error = error
            return 1
        return 0

"""Blocks of the loop that are not of this library, called from the compiled loop by address, as C functions.

All have one signature, ``int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)``;
anything but 0 ends the flight.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

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


def call_step(function: int, step: int, inputs: int, outputs: int, state: int, parameters: int) -> int:
    """Call the step function at an address, with addresses of its arrays, and return what it returns.

    For compiled functions, see :mod:`hsv.simulation.foreign_call`; it is called from Python likewise.
    """
    return int(STEP_FUNCTION(function)(step, inputs, outputs, state, parameters))


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

"""Arrays and records with one number a lane, as Python holds them; see :mod:`hsv.lanes`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

BLOCK = 24
"""A common multiple of the numbers in a register of any processor (4, 8) and of the sums of lanes at a time (6, 12)."""

_LINE = 8
"""Numbers of a line of the caches: what a register holds is of one line where an array begins with one."""


def _empty(shape: tuple[int, ...]) -> np.ndarray:
    """Return room for numbers that begins with a line: a part of some more rows, of at least a number each."""
    more = np.empty((shape[0] + _LINE, *shape[1:]))
    start = -more.ctypes.data // more.itemsize % _LINE
    return more.ravel()[start : start + more[_LINE:].size].reshape(shape)


def kind_of_array(axes: int, lanes: int, split: bool) -> str:
    """Return the name of the numba type of such a :class:`LaneArray`."""
    return f"LaneArray({axes}, {lanes}, {split})"


def kind_of_record(fields: tuple[str, ...], lanes: int) -> str:
    """Return the name of the numba type of such a :class:`LaneRecord`."""
    return f"LaneRecord({fields}, {lanes})"


class LaneArray:
    """An array of lanes, for compiled functions: indexed like an array whose elements are numbers."""

    def __init__(self, array: np.ndarray, *, split: bool = False) -> None:
        """View ``array``, contiguous (of a lane), of float64.

        Args:
            array: (..., lanes), or (lanes, ...) where ``split``.
            split: Whether each lane's numbers are on their own, as histories are; else those of an element are.
        """
        if array.dtype != np.float64 or not (array[0] if split else array).flags.c_contiguous:
            raise ValueError(f"array of {array.dtype}: expected contiguous float64")
        self.array = array
        self.split = split
        self.lanes = array.shape[0] if split else array.shape[-1]
        self.shape = array.shape[1:] if split else array.shape[:-1]
        self.address = array.ctypes.data
        self.stride = array.strides[0] // array.itemsize if split else 1

    @property
    def kind(self) -> str:
        """The name of the numba type, by which functions compiled ahead of time are found."""
        return kind_of_array(len(self.shape), self.lanes, self.split)

    @classmethod
    def zeros(cls, shape: int | Sequence[int]) -> LaneArray:
        """Return zeros, as many lanes as there are flights side by side."""
        from hsv.lane_types import WIDTH  # imports numba

        array = _empty((*((shape,) if isinstance(shape, int) else shape), WIDTH))
        array[:] = 0.0
        return cls(array)

    @classmethod
    def of(cls, arrays: Sequence[np.ndarray]) -> LaneArray:
        """Return a copy of equal arrays, one a lane."""
        array = _empty((*arrays[0].shape, len(arrays)))
        return cls(np.stack(arrays, axis=-1, out=array))


class LaneRecord:
    """A named tuple of numbers for each lane, for compiled functions: an attribute is one number a lane."""

    def __init__(self, tuples: Sequence[Any]) -> None:
        self.fields = tuple(tuples[0]._fields)
        self.array = _empty((len(self.fields), len(tuples)))
        self.array[:] = np.array(tuples, float).T
        self.address = self.array.ctypes.data

    @property
    def kind(self) -> str:
        """The name of the numba type, by which functions compiled ahead of time are found."""
        return kind_of_record(self.fields, self.array.shape[-1])

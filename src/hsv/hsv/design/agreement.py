"""Difference between a recomputed design and the shipped one, in scaled coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.certificate.checks import Subject
from hsv.certificate.tolerances import PARAMETERS, RECOMPUTED_DESIGN, entry_size
from hsv.control.design import ControlDesign


@dataclass(frozen=True)
class Deviation:
    """Largest deviation of one parameter of a recomputed design from the shipped design.

    At the entry ``index`` the recomputed ``value`` deviates most from the shipped value ``expected`` (SI). ``scaled``:
    their difference, divided by the larger of the shipped magnitude and the typical size of the entry.
    """

    parameter: str
    scaled: float
    index: tuple[int, ...]
    value: float
    expected: float

    @property
    def ok(self) -> bool:
        """Whether the difference, ``scaled``, is at most :data:`RECOMPUTED_DESIGN`."""
        return self.scaled <= RECOMPUTED_DESIGN

    def __str__(self) -> str:
        where = f"[{', '.join(map(str, self.index))}]" if self.index else ""
        return (
            f"{self.parameter}{where} = {self.value!r}: expected {self.expected!r}; they differ by {self.scaled:.2g} "
            f"in scaled coordinates, expected at most {RECOMPUTED_DESIGN:g}"
        )


def deviations(design: ControlDesign, shipped: Subject) -> list[Deviation]:
    """Return the largest deviation of each parameter of ``design`` from that of ``shipped``.

    If the numbers of entries differ, ``value`` and ``expected`` are these numbers and ``scaled`` is infinite.
    """
    values, expected = design.to_parameters(), shipped.design.to_parameters()
    return [
        _largest(name, values.get(name, []), expected.get(name, []), entry_size(name, shipped.certificate))
        for name in PARAMETERS
        if name in values or name in expected
    ]


def _largest(parameter: str, given: float | list[float], written: float | list[float], size: np.ndarray) -> Deviation:
    value, expected = np.array(given, float), np.array(written, float)
    if value.shape != expected.shape:
        return Deviation(parameter, np.inf, (), float(value.size), float(expected.size))
    if size.ndim > 1:
        shape = size.shape if value.size == size.size else (-1, *size.shape)
        value, expected = value.reshape(shape), expected.reshape(shape)
    size = np.maximum(np.abs(expected), size if expected.ndim else size[0])
    scaled = np.nan_to_num(np.abs(value - expected) / size, nan=np.inf, posinf=np.inf)
    if not scaled.size:
        return Deviation(parameter, 0.0, (), 0.0, 0.0)
    index = tuple(map(int, np.unravel_index(int(np.argmax(scaled)), scaled.shape)))
    return Deviation(parameter, float(scaled[index]), index, float(value[index]), float(expected[index]))

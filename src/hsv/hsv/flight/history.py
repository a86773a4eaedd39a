"""The history of a flight: the main signals in every step."""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from hsv.model.signals import GAIN_INDEX as GAIN
from hsv.model.signals import N_STATES, UNSATURATED_INPUT
from hsv.model.signals import SIGNALS as TYPES

_COLUMNS = "state", "filtered_pitch_rate", "deviation", "nominal_input", "command", "actuator"
X, Q_F, X_N, U_N, U, ACTUATOR, SIGNAL_COLUMNS = accumulate((0, *(TYPES[name].size for name in _COLUMNS)))
"""First column of x, q_f, x_n, u_n, command u and actuator input in :attr:`History.signals`, and the total number."""

GAIN_INDEX, U_UNSATURATED, AUXILIARY_COLUMNS = accumulate((0, GAIN.size, UNSATURATED_INPUT.size))
"""First column of gain index and unsaturated input in :attr:`History.auxiliary`, and the total number."""


def _signals(first: int, end: int, meaning: str) -> property:
    """Return a property of :class:`History`: the columns ``first`` to ``end`` - 1 of its ``signals``."""
    return property(lambda history: history.signals[:, first:end], doc=meaning)


class _Matrices(NamedTuple):
    signals: np.ndarray
    """(n + 1, 25): x, q_f, x_n, u_n, u and actuator input, which the fingerprint digests"""
    auxiliary: np.ndarray
    """(n + 1, 3): index of the nominal gain, 0 for the outermost ellipsoid, and unsaturated input"""
    estimated: np.ndarray | None
    """(n + 1, 9): state that the controller receives, measured or estimated; None if it is the true state"""


class History(_Matrices):
    """The signals of a flight that are named in :data:`SIGNALS`, for the steps k = 0 ... n, SI."""

    @classmethod
    def empty(cls, rows: int, *, estimated: bool = True) -> History:
        """Return a history of ``rows`` uninitialised steps; ``estimated``: with memory for :attr:`estimate`."""
        numbers = cls.numbers() if estimated else SIGNAL_COLUMNS + AUXILIARY_COLUMNS
        return cls.over(np.empty(rows * numbers), rows, estimated=estimated)

    @classmethod
    def of(cls, **signals: np.ndarray) -> History:
        """Return a history of the given ``signals``, n + 1 rows each; others are NaN, but ``estimate`` is ``state``."""
        history = cls.empty(len(next(iter(signals.values()))), estimated=False)
        history.signals[:] = history.auxiliary[:] = np.nan
        for name, values in signals.items():
            getattr(history, name)[:] = values
        return history

    @classmethod
    def over(cls, memory: np.ndarray, rows: int, *, estimated: bool = True) -> History:
        """Return a history of ``rows`` steps in ``memory``, whose last axis has the flattened matrices in succession.

        Leading axes of ``memory`` also lead the shape of each matrix; ``estimated``: as for :meth:`empty`.
        """
        matrices, start = [], 0
        for width in (SIGNAL_COLUMNS, AUXILIARY_COLUMNS, N_STATES)[: 3 if estimated else 2]:
            stop = start + rows * width
            matrices.append(memory[..., start:stop].reshape(*memory.shape[:-1], rows, width))
            start = stop
        return cls(matrices[0], matrices[1], matrices[2] if estimated else None)

    @staticmethod
    def numbers() -> int:
        """Return the number of values per step, including an estimated state."""
        return SIGNAL_COLUMNS + AUXILIARY_COLUMNS + N_STATES

    state = _signals(X, Q_F, "State x (n + 1, 9)")
    filtered_pitch_rate = property(lambda self: self.signals[:, Q_F], doc="Filtered pitch rate q_f (n + 1), rad/s")
    deviation = _signals(X_N, U_N, "Nominal deviation x_n (n + 1, 9)")
    nominal_input = _signals(U_N, U, "Nominal input u_n (n + 1, 2)")
    command = _signals(U, ACTUATOR, "Command u (n + 1, 2), limited to the input range")
    actuator = _signals(ACTUATOR, SIGNAL_COLUMNS, "Command after link and command faults (n + 1, 2)")
    gain_index = property(lambda self: self.auxiliary[:, GAIN_INDEX], doc="Index of the nominal gain (n + 1)")
    u_unsaturated = property(lambda self: self.auxiliary[:, U_UNSATURATED:], doc="Command before saturation (n + 1, 2)")

    @property
    def estimate(self) -> np.ndarray:
        """The state that the controller receives: the true, the measured or the estimated one; shape (n + 1, 9)."""
        return self.state if self.estimated is None else self.estimated

    def columns(self) -> dict[str, np.ndarray]:
        """Return the signals by name, in the order of :data:`SIGNALS`."""
        return {name: getattr(self, name) for name in SIGNALS}

    def copy(self) -> History:
        """Return a copy in new memory."""
        estimated = None if self.estimated is None else self.estimated.copy()
        return History(self.signals.copy(), self.auxiliary.copy(), estimated)

    def cut(self, rows: int) -> History:
        """Return the history of the first ``rows`` steps, in the same memory."""
        estimated = None if self.estimated is None else self.estimated[:rows]
        return History(self.signals[:rows], self.auxiliary[:rows], estimated)


SIGNALS = (
    "state",
    "estimate",
    "filtered_pitch_rate",
    "deviation",
    "nominal_input",
    "gain_index",
    "u_unsaturated",
    "command",
    "actuator",
)
"""Names of the signals of a :class:`History`, in the order in which the loop computes them."""

"""The history of a flight: every signal of every step."""

from __future__ import annotations

from itertools import accumulate
from typing import NamedTuple

import numpy as np

from hsv.model.signals import N_INPUTS, N_STATES

X, Q_F, X_N, U_N, U, ACTUATOR, SIGNAL_COLUMNS = accumulate((0, N_STATES, 1, N_STATES, N_INPUTS, N_INPUTS, N_INPUTS))
"""First columns of x, q_f, x_n, u_n, command u and actuator input in :attr:`History.signals`; then their number."""

GAIN_INDEX, U_UNSATURATED, AUXILIARY_COLUMNS = accumulate((0, 1, N_INPUTS))
"""First columns of gain index and unsaturated input in :attr:`History.auxiliary`, and the total number."""


def _signals(first: int, end: int, meaning: str) -> property:
    """Return a property with some columns of :attr:`History.signals`."""
    return property(lambda history: history.signals[:, first:end], doc=meaning)


class _Matrices(NamedTuple):
    signals: np.ndarray
    """(n + 1, 25): the signals of the fingerprint"""
    auxiliary: np.ndarray
    """(n + 1, 3): auxiliary signals"""
    estimated: np.ndarray | None
    """(n + 1, 9): measured or estimated state, None if that is the state itself"""


class History(_Matrices):
    """All signals of a flight for the steps k = 0 ... n, SI."""

    @classmethod
    def empty(cls, rows: int, *, estimated: bool = True) -> History:
        """Return an empty history of ``rows`` steps, with the measured or estimated state if ``estimated``."""
        numbers = cls.numbers() if estimated else SIGNAL_COLUMNS + AUXILIARY_COLUMNS
        return cls.over(np.empty(rows * numbers), rows, estimated=estimated)

    @classmethod
    def of(cls, **signals: np.ndarray) -> History:
        """Return a history with these ``signals`` (n + 1 rows each), by name; the others are NaN."""
        history = cls.empty(len(next(iter(signals.values()))), estimated=False)
        history.signals[:] = history.auxiliary[:] = np.nan
        for name, values in signals.items():
            getattr(history, name)[:] = values
        return history

    @classmethod
    def over(cls, memory: np.ndarray, rows: int, *, estimated: bool = True) -> History:
        """Return a history of ``rows`` steps in ``memory`` (..., numbers), one matrix after the other."""
        matrices, start = [], 0
        for width in (SIGNAL_COLUMNS, AUXILIARY_COLUMNS, N_STATES)[: 3 if estimated else 2]:
            stop = start + rows * width
            matrices.append(memory[..., start:stop].reshape(*memory.shape[:-1], rows, width))
            start = stop
        return cls(matrices[0], matrices[1], matrices[2] if estimated else None)

    @staticmethod
    def numbers() -> int:
        """Return the number of values of a step."""
        return SIGNAL_COLUMNS + AUXILIARY_COLUMNS + N_STATES

    state = _signals(X, Q_F, "State x (n + 1, 9)")
    filtered_pitch_rate = property(lambda self: self.signals[:, Q_F], doc="q_f (n + 1), rad/s")
    deviation = _signals(X_N, U_N, "x_n (n + 1, 9)")
    nominal_input = _signals(U_N, U, "u_n (n + 1, 2)")
    command = _signals(U, ACTUATOR, "Input u (n + 1, 2)")
    actuator = _signals(ACTUATOR, SIGNAL_COLUMNS, "Input of the actuators (n + 1, 2)")
    gain_index = property(lambda self: self.auxiliary[:, GAIN_INDEX], doc="Index in the nested family (n + 1)")
    u_unsaturated = property(lambda self: self.auxiliary[:, U_UNSATURATED:], doc="Input before saturation (n + 1, 2)")

    @property
    def estimate(self) -> np.ndarray:
        """State that the controller receives (n + 1, 9): measured, or estimated if an estimator is enabled."""
        return self.state if self.estimated is None else self.estimated

    def columns(self) -> dict[str, np.ndarray]:
        """Return all signals by name, in the order of the loop."""
        return {name: getattr(self, name) for name in SIGNALS}

    def copy(self) -> History:
        """Return a copy in new memory."""
        estimated = None if self.estimated is None else self.estimated.copy()
        return History(self.signals.copy(), self.auxiliary.copy(), estimated)

    def cut(self, rows: int) -> History:
        """Return the first ``rows`` steps."""
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
"""Signals of a :class:`History`, in the order of the loop."""

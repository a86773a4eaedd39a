"""The notch filter fed with the pitch rate of reference + nominal: what the filter would say if the plan were flown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hsv.control.notch_filter import NotchData, filter_step


@dataclass(frozen=True)
class PlannedResult:
    """``filtered_pitch_rate`` q'_n (rad/s) of the plan and the filter states s_n (2 s) before their update."""

    filtered_pitch_rate: float
    filter_state: np.ndarray


class PlannedFilter:
    """The same discrete filter as the one in the loop.

    It starts from the state of that filter: exact at the start of a run, where x = x_r + x_n.
    """

    def __init__(self, notch: NotchData) -> None:
        self._notch = notch
        self._state = np.zeros(2 * len(notch.D))
        self._started = False

    def reset(self) -> None:
        """Forget the past: the next step starts a new run."""
        self._started = False

    def step(self, planned_rate: float, filter_state: np.ndarray) -> PlannedResult | None:
        """Filter the ``planned_rate`` (rad/s) of reference + nominal.

        Args:
            planned_rate: Pitch rate of reference + nominal.
            filter_state: (2 s) of the filter in the loop before its update; of another size: it is not in the loop,
                and there is no result.
        """
        if not len(filter_state) == len(self._state) > 0:
            return None
        if not self._started:
            self._state[:] = filter_state
            self._started = True
        before = self._state.copy()
        return PlannedResult(filter_step(self._notch, self._state, planned_rate), before)

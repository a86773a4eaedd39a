"""Integral action on the altitude and velocity errors of the tube: a named extension of the paper's law.

It removes the offset that a wrong mass or a lost elevator leaves. It adds two states that the invariant set does not
know, and is off by default.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np

from hsv.control.design_file import ControlDesign
from hsv.control.tube_law import TubeLaw, TubeResult
from hsv.parameters import Parameter, check_all

INTEGRAL_PARAMETERS = (
    Parameter("integral.rate", 0.0, "k of the integral gain k F(:, [h V]); 0: no integral action", "1/s", 0.0, 1.0),
)

_ALTITUDE_AND_VELOCITY = slice(0, 2)


class IntegralTubeLaw:
    """The tube law plus K_i times the integral of e over h and V, K_i = k F(:, [h V]).

    The integral stands still in every step in which an input is limited.
    """

    def __init__(self, law: TubeLaw, period: float, rate: float) -> None:
        """Add integral action at ``rate`` k (1/s) to ``law``, sampled at ``period`` (s)."""
        self._law = law
        self._period = period
        self._rate = rate
        self._integral = np.zeros(2)

    @classmethod
    def from_parameters(cls, values: Mapping[str, Any], design: ControlDesign | None = None) -> Self:
        """Build from the design's parameters and :data:`INTEGRAL_PARAMETERS`; a wrong one is named.

        ``design``: the one in ``values``, where it is known already.
        """
        v = check_all(INTEGRAL_PARAMETERS, values)
        design = design or ControlDesign.from_parameters(values)
        return cls(TubeLaw.from_parameters(values, design), design.period, v["integral.rate"])

    def reset(self) -> None:
        """Empty the integral and start a new run."""
        self._integral[:] = 0.0
        self._law.reset()

    def change_tau(self, values: Sequence[float]) -> int:
        """Change the factor, also of the integral; see :meth:`hsv.control.tube_law.TubeLaw.change_tau`."""
        return self._law.change_tau(values)

    def step(
        self,
        state: np.ndarray,
        filtered_pitch_rate: float,
        filter_state: np.ndarray,
        reference: np.ndarray,
        reference_input: np.ndarray,
        deviation: np.ndarray,
        nominal_input: np.ndarray,
    ) -> TubeResult:
        """Return the input of this step; arguments as in :meth:`hsv.control.tube_law.TubeLaw.step`."""
        # Written out: the order of a matrix product's sums depends on the machine.
        altitude, velocity = (self._rate * self._law.gain[:, _ALTITUDE_AND_VELOCITY] * self._integral).T
        integral_input = altitude + velocity
        result = self._law.step(
            state,
            filtered_pitch_rate,
            filter_state,
            reference,
            reference_input,
            deviation,
            nominal_input + integral_input,
        )
        if not result.saturated.any():
            self._integral += self._period * result.error[_ALTITUDE_AND_VELOCITY]
        return replace(result, u_feedback=result.u_feedback + integral_input)

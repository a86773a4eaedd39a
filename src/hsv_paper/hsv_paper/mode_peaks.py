"""Peaks of the elastic modes in the response of the pitch rate to the elevator, before and after a notch filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from hsv.control.notch_filter import NotchSection, notch_response
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import Mode, bode, modes
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.bode import pitch_rate_response
from hsv_paper.linear_loop import START

WINDOW = 0.1
"""The peak of a mode is the highest within this share of its natural frequency."""

FREQUENCIES = np.geomspace(10.0, 25.0, 15001)
"""rad/s."""


@dataclass(frozen=True)
class Peak:
    """A local maximum of a response: where (rad/s) and how high (dB)."""

    frequency: float
    magnitude: float


@dataclass(frozen=True)
class PeakFall:
    """The peak of a mode without the filter and the remaining peak with the filter, ``None``: no local maximum.

    ``natural_frequency``: of the mode, rad/s; the peak is beside it, where what else answers adds to it.
    """

    natural_frequency: float
    before: Peak
    after: Peak | None

    @property
    def decibel(self) -> float:
        """Decrease of the highest point, peak to peak, in dB; the peak may move; infinite if none is left."""
        return float("inf") if self.after is None else self.before.magnitude - self.after.magnitude


def highest_peak(frequencies: np.ndarray, response: np.ndarray, low: float, high: float) -> Peak | None:
    """Return the highest local maximum of a response (f) between two frequencies (rad/s), ``None`` without one.

    A local maximum, not the largest value: at the edge of a window that is the flank of the other mode.
    """
    magnitude = bode(response)[0]
    found = [i for i in find_peaks(magnitude)[0] if low < frequencies[i] < high]
    if not found:
        return None
    top = max(found, key=lambda i: magnitude[i])
    return Peak(float(frequencies[top]), float(magnitude[top]))


def elastic_modes(coupling: str | float) -> dict[str, Mode]:
    """Return the two elastic modes of the coupled model, linearised where Case 1 starts."""
    vehicle = load_vehicle().coupled(coupling)
    point = trim(vehicle, *START)
    second, first = modes(jacobian(point.state, point.input, vehicle)[0])[:2]
    return {"first": first, "second": second}


def peak_falls(sections: Sequence[NotchSection], coupling: str | float = "paper_like") -> dict[str, PeakFall]:
    """Return what ``sections`` in series do to the peak of each mode, elevator to filtered pitch rate.

    Continuous time, the vehicle of a named ``coupling`` linearised where Case 1 starts.
    """
    plain = pitch_rate_response(load_vehicle().coupled(coupling), FREQUENCIES)
    filtered = plain * notch_response(sections, FREQUENCIES)
    falls = {}
    for name, mode in elastic_modes(coupling).items():
        window = ((1.0 - WINDOW) * mode.natural_frequency, (1.0 + WINDOW) * mode.natural_frequency)
        before = highest_peak(FREQUENCIES, plain, *window)
        assert before is not None
        falls[name] = PeakFall(mode.natural_frequency, before, highest_peak(FREQUENCIES, filtered, *window))
    return falls

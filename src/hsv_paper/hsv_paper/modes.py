"""The coupled model linearised where Case 1 starts: its modes, and their peaks from elevator to pitch rate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from hsv.control.notch_filter import NotchSection, notch_response
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import Mode, bode, frequency_response, modes
from hsv.model.signals import PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import ELEVATOR, START

Coupling = str | float
"""Name of a coupling set, or a multiple of the derived one."""

WINDOW = 0.1
"""The peak of a mode is the highest within this share of its natural frequency."""

FREQUENCIES = np.geomspace(10.0, 25.0, 15001)
"""rad/s: about the elastic modes."""


class Peak(NamedTuple):
    """A local maximum of a response: frequency (rad/s) and magnitude (dB)."""

    frequency: float
    magnitude: float


class PeakFall(NamedTuple):
    """The peak of a mode without the filter and the remaining peak with it; ``None``: no local maximum remains.

    The peak lies beside the mode's natural frequency (rad/s), because the rest of the response adds to it.
    """

    natural_frequency: float
    before: Peak
    after: Peak | None

    @property
    def decibel(self) -> float:
        """Reduction from peak to peak, dB; infinite if no peak remains."""
        return float("inf") if self.after is None else self.before.magnitude - self.after.magnitude


@cache
def linearised(coupling: Coupling) -> tuple[np.ndarray, np.ndarray]:
    """Return A (9, 9) and B (9, 2) of the vehicle with a coupling, in trim where Case 1 starts."""
    vehicle = load_vehicle().coupled(coupling)
    point = trim(vehicle, *START)
    return jacobian(point.state, point.input, vehicle)


def open_loop_modes(coupling: Coupling) -> list[Mode]:
    """Return all modes of the model, fastest first."""
    return modes(linearised(coupling)[0])


def elastic_modes(coupling: Coupling) -> dict[str, Mode]:
    """Return the two elastic modes, "first" and "second"."""
    second, first = open_loop_modes(coupling)[:2]
    return {"first": first, "second": second}


def pitch_rate_response(coupling: Coupling, frequencies: np.ndarray) -> np.ndarray:
    """Return q / delta_e (f), 1/s, in continuous time."""
    return frequency_response(*linearised(coupling), frequencies)[:, PITCH_RATE, ELEVATOR]


def highest_peak(frequencies: np.ndarray, response: np.ndarray, low: float, high: float) -> Peak | None:
    """Return the highest local maximum of a response (f) between two frequencies (rad/s), ``None`` without one.

    The largest value would not do: at the edge of a window it is the flank of the other mode.
    """
    magnitude = bode(response)[0]
    found = [i for i in find_peaks(magnitude)[0] if low < frequencies[i] < high]
    top = max(found, key=lambda i: magnitude[i], default=None)
    return None if top is None else Peak(float(frequencies[top]), float(magnitude[top]))


def peak_falls(sections: Sequence[NotchSection]) -> dict[str, PeakFall]:
    """Return the effect of filter ``sections`` in series on the peak of each mode, elevator to filtered pitch rate."""
    plain = pitch_rate_response("paper_like", FREQUENCIES)
    filtered = plain * notch_response(sections, FREQUENCIES)
    falls = {}
    for name, mode in elastic_modes("paper_like").items():
        window = ((1.0 - WINDOW) * mode.natural_frequency, (1.0 + WINDOW) * mode.natural_frequency)
        before = highest_peak(FREQUENCIES, plain, *window)
        assert before is not None
        falls[name] = PeakFall(mode.natural_frequency, before, highest_peak(FREQUENCIES, filtered, *window))
    return falls

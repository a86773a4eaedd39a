"""Modes of the coupled model, linearised at the start of Case 1, and their peaks from elevator to pitch rate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.signal import find_peaks

from hsv.certificate.loops import ELEVATOR
from hsv.control.notch_filter import NotchSection, notch_response
from hsv.model.dynamics import jacobian
from hsv.model.lpv.linearisation import Mode, bode, frequency_response, modes
from hsv.model.signals import PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import START

Coupling = str | float
"""Name of a set of coupling coefficients, or a multiple of the derived set."""

WINDOW = 0.1
"""A mode's peak is sought within this share of its natural frequency."""

FREQUENCIES = np.geomspace(10.0, 25.0, 15001)
"""Frequencies (rad/s) around those of the elastic modes."""


class Peak(NamedTuple):
    """A local maximum of a response: magnitude (dB) and frequency (rad/s)."""

    magnitude: float
    frequency: float


@cache
def linearised(coupling: Coupling) -> tuple[np.ndarray, np.ndarray]:
    """Return A (9, 9) and B (9, 2) of the vehicle with this coupling, in trim at the start of Case 1."""
    vehicle = load_vehicle().coupled(coupling)
    point = trim(vehicle, *START)
    return jacobian(point.state, point.input, vehicle)


def open_loop_modes(coupling: Coupling) -> list[Mode]:
    """Return all modes of the vehicle with this coupling, fastest first."""
    return modes(linearised(coupling)[0])


def elastic_modes(coupling: Coupling) -> dict[str, Mode]:
    """Return the two elastic modes by name, "first" and "second"."""
    second, first = open_loop_modes(coupling)[:2]
    return {"first": first, "second": second}


def pitch_rate_response(coupling: Coupling, frequencies: np.ndarray) -> np.ndarray:
    """Return the complex response of pitch rate to elevator (1/s), continuous time, at ``frequencies`` (rad/s)."""
    return frequency_response(*linearised(coupling), frequencies)[:, PITCH_RATE, ELEVATOR]


def peaks(sections: Sequence[NotchSection]) -> dict[str, Peak]:
    """Return each elastic mode's peak in the response of the filtered pitch rate to the elevator; -inf dB if none.

    The coupling is paper-like. The rest of the response moves a peak away from the mode's natural frequency.
    """
    magnitude, _ = bode(pitch_rate_response("paper_like", FREQUENCIES) * notch_response(sections, FREQUENCIES))
    # A maximum over the window would not do: at the edge it may be on the flank of the other mode.
    maxima = find_peaks(magnitude)[0]
    found = {}
    for name, mode in elastic_modes("paper_like").items():
        near = [i for i in maxima if abs(FREQUENCIES[i] / mode.natural_frequency - 1.0) < WINDOW]
        highest = (Peak(float(magnitude[i]), float(FREQUENCIES[i])) for i in near)
        found[name] = max(highest, default=Peak(-np.inf, np.nan))
    return found


def peak_falls(sections: Sequence[NotchSection]) -> dict[str, float]:
    """Return by how much (dB) ``sections`` reduce each mode's peak in :func:`peaks`; infinite if no peak remains."""
    remaining = peaks(sections)
    return {name: peak.magnitude - remaining[name].magnitude for name, peak in peaks(()).items()}

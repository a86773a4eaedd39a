"""Frequency responses that the figures compare, and their panels."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MultipleLocator

from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.linearisation import bode, frequency_response
from hsv.model.signals import PITCH_RATE
from hsv.model.trim import trim
from hsv_paper.linear_loop import ELEVATOR, START


def pitch_rate_response(vehicle: VehicleParameters, frequencies: np.ndarray) -> np.ndarray:
    """Return q / delta_e (f), in 1/s, of ``vehicle`` linearised where Case 1 starts; continuous time."""
    point = trim(vehicle, *START)
    A, B = jacobian(point.state, point.input, vehicle)
    return frequency_response(A, B, frequencies)[:, PITCH_RATE, ELEVATOR]


def bode_lines(
    magnitude: Axes,
    phase: Axes,
    frequencies: np.ndarray,
    response: np.ndarray,
    label: str,
    **style: Any,
) -> None:
    """Draw a response (f) into a magnitude and a phase panel.

    The phase at the lowest frequency is within half a turn of -270 deg, about which that of elevator to pitch rate is
    from the slow modes to the elastic ones: all figures show the same branch.
    """
    decibel, degree = bode(response)
    degree = degree - 360.0 * np.round((degree[0] + 270.0) / 360.0)
    magnitude.semilogx(frequencies, decibel, label=label, **style)
    phase.semilogx(frequencies, degree, **style)


def label_bode(magnitude: Axes, phase: Axes, frequencies: np.ndarray) -> None:
    """Label the axes of a magnitude and a phase panel."""
    magnitude.set_ylabel("Magnitude (dB)")
    phase.set_ylabel("Phase (deg)")
    phase.set_xlabel("Frequency (rad/s)")
    phase.yaxis.set_major_locator(MultipleLocator(45.0))
    for axis in (magnitude, phase):
        axis.set_xlim(frequencies[0], frequencies[-1])
        axis.grid(which="minor", linewidth=0.25, alpha=0.25)

"""Natural frequency and damping of the poles of a continuous-time system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Mode:
    """A real pole, or the upper one of a pair (rad/s), its natural frequency (rad/s) and damping ratio."""

    pole: complex
    natural_frequency: float
    damping_ratio: float


def modes(A: np.ndarray) -> list[Mode]:
    """Return the modes of ``A`` (n, n), fastest first; a damping ratio of -1 marks an unstable real pole."""
    found = []
    for pole in np.linalg.eigvals(A).tolist():
        if pole.imag >= 0.0:
            frequency = abs(pole)
            found.append(Mode(complex(pole), frequency, -complex(pole).real / frequency if frequency else 0.0))
    return sorted(found, key=lambda mode: -mode.natural_frequency)

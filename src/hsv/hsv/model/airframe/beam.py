"""First bending mode of a uniform cantilever: clamped at the centre of gravity, free at nose or tail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EIGENVALUE = 1.8751040687119611
"""The least positive root of 1 + cos(b) cosh(b)."""


@dataclass(frozen=True)
class Cantilever:
    """A uniform Euler-Bernoulli beam and its first mode, normalised to the unit of modal mass.

    The deflection is w(s, t) = shape(s) * eta(t) with eta in kg^0.5 m, as the vehicle's states have it.
    """

    length: float
    """Length in metres."""
    mass_per_length: float
    """Mass per length in kg/m."""

    def shape(self, distance: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Return the mode (kg^-0.5) at a distance (m, any shape) from the clamp, or its derivative (kg^-0.5/m^n)."""
        b = EIGENVALUE
        x = b * np.asarray(distance, float) / self.length
        ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        # Derivatives of cosh - cos and of sinh - sin; the fourth is the function itself.
        hyperbolic = (np.cosh(x), np.sinh(x))
        circular = ((-np.cos(x), -np.sin(x)), (np.sin(x), -np.cos(x)), (np.cos(x), np.sin(x)), (-np.sin(x), np.cos(x)))
        turn = derivative % 4
        even = hyperbolic[turn % 2] + circular[turn][0]
        odd = hyperbolic[1 - turn % 2] + circular[turn][1]
        scale = (b / self.length) ** derivative / np.sqrt(self.mass_per_length * self.length)
        return np.asarray(scale * (even - ratio * odd))

    def bending_stiffness(self, natural_frequency: float) -> float:
        """Return EI (N m^2) of a beam whose first mode has this frequency (rad/s)."""
        return self.mass_per_length * (natural_frequency * (self.length / EIGENVALUE) ** 2) ** 2

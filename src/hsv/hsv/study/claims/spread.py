"""A number over vehicles: with the paper's uncertain parameters, nominal, and at all corners of their bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hsv.study.claims.claim import Reading


@dataclass(frozen=True)
class Spread:
    """Magnitudes (SI): of the flight with uncertain parameters, and of ``vehicles`` (n), the nominal one first.

    What a lost flight does not define is not a number.
    """

    uncertain: float
    vehicles: np.ndarray

    @property
    def nominal(self) -> float:
        """Of the nominal vehicle."""
        return float(self.vehicles[0])

    @property
    def worst(self) -> float:
        """Largest of all vehicles; infinite where one was lost."""
        return float(np.inf) if np.any(np.isnan(self.vehicles)) else float(self.vehicles.max())

    def over(self, other: Spread) -> Spread:
        """Return the ratio to another number, vehicle by vehicle."""
        return Spread(self.uncertain / other.uncertain, self.vehicles / other.vehicles)

    def readings(
        self,
        what: str,
        unit: str,
        *,
        at_most: float | None = None,
        at_least: float | None = None,
        first: Literal["uncertain", "nominal"] = "uncertain",
    ) -> tuple[Reading, Reading, Reading]:
        """Return the number with uncertain parameters, nominal, and of the vehicle least in favour of the claim.

        Args:
            what: Is read.
            unit: Of SI.
            at_most: Threshold, or
            at_least: threshold.
            first: Which of the first two comes first, as the statement itself.
        """
        extreme = self.worst if at_least is None else float(self.vehicles.min())
        one, other = ("uncertain parameters", self.uncertain), ("nominal vehicle", self.nominal)
        if first == "nominal":
            one, other = other, one
        rows = (one, other, ("worst corner", extreme))
        a, b, c = (Reading(f"{what}, {vehicle}", value, unit, at_most, at_least) for vehicle, value in rows)
        return a, b, c

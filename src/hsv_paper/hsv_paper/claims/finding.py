"""Readings, which are numbers with thresholds, and the verdict that follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from hsv.base.units import UnitSystem, in_system


class Verdict(StrEnum):
    """Verdict on a claim."""

    HOLDS = "holds"
    CONDITIONS = "holds under conditions"
    FAILS = "does not hold"


def shown(value: float, unit: str, units: UnitSystem = UnitSystem.paper) -> str:
    """Return a number (SI) with its unit, by default the paper's; an infinite time is beyond the end of the flight."""
    if not math.isfinite(value):
        return "not defined" if math.isnan(value) else "not by the end" if unit == "s" else "unbounded"
    number, name = in_system(value, unit, units)
    return f"{number:.4g}" + ("" if name == "1" else f" {name}")


@dataclass(frozen=True)
class Reading:
    """One way to read a claim: a number (SI) that must be at most, or at least, a threshold."""

    what: str
    value: float
    unit: str
    at_most: float | None = None
    at_least: float | None = None
    actuators: str = ""
    """Name of the actuators between command and vehicle; empty for the paper's, if the claim names none."""

    def measured(self, units: UnitSystem = UnitSystem.paper) -> str:
        """Return the number with its unit."""
        return shown(self.value, self.unit, units)

    def threshold(self, units: UnitSystem = UnitSystem.paper) -> str:
        """Return the threshold in words."""
        if self.at_most is not None:
            return f"at most {shown(self.at_most, self.unit, units)}"
        assert self.at_least is not None
        return f"at least {shown(self.at_least, self.unit, units)}"

    @property
    def holds(self) -> bool:
        """Whether the number satisfies the threshold; NaN does not."""
        if self.at_most is not None:
            return bool(self.value <= self.at_most)
        return bool(self.at_least is not None and self.value >= self.at_least)


@dataclass(frozen=True)
class Finding:
    """The readings of a claim, and the reasons for their results.

    The first ``leading`` readings are the statement itself under the paper's own conditions, one for each number in it;
    the others repeat it under further conditions.
    """

    readings: tuple[Reading, ...]
    why: str
    leading: int = 1

    @property
    def verdict(self) -> Verdict:
        """Whether the claim holds in all readings, only in those of the statement itself, or not in these."""
        kept = [reading.holds for reading in self.readings]
        if not all(kept[: self.leading]):
            return Verdict.FAILS
        return Verdict.HOLDS if all(kept) else Verdict.CONDITIONS

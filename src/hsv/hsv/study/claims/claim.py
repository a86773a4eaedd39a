"""A statement of the paper, turned into numbers with thresholds; the verdict follows from the numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from hsv.study.claims.evidence import Evidence


class Verdict(StrEnum):
    """What became of a claim."""

    HOLDS = "holds"
    CONDITIONS = "holds under conditions"
    FAILS = "does not hold"


@dataclass(frozen=True)
class Reading:
    """One way to read a claim: a number (SI) that is to be at most, or at least, a threshold."""

    what: str
    value: float
    unit: str
    at_most: float | None = None
    at_least: float | None = None

    @property
    def holds(self) -> bool:
        """Whether the number keeps to the threshold; what is not a number does not."""
        if self.at_most is not None:
            return bool(self.value <= self.at_most)
        return bool(self.at_least is not None and self.value >= self.at_least)


@dataclass(frozen=True)
class Finding:
    """The readings of a claim, and why they come out as they do."""

    readings: tuple[Reading, ...]
    why: str

    @property
    def verdict(self) -> Verdict:
        """Holds in all readings, in some, in none."""
        kept = [reading.holds for reading in self.readings]
        if all(kept):
            return Verdict.HOLDS
        return Verdict.CONDITIONS if any(kept) else Verdict.FAILS


@dataclass(frozen=True)
class Claim:
    """A statement, word for word, where it stands, and the function that measures it."""

    name: str
    quote: str
    location: str
    measure: Callable[[Evidence], Finding]


@dataclass(frozen=True)
class Judged:
    """A claim with its finding."""

    claim: Claim
    finding: Finding

"""The table of the paper's claims, ``claims.yaml``, and the measuring and judging of each claim."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from importlib.resources import files
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from hsv.base.files import parse_yaml
from hsv.base.processes import Progress
from hsv.base.units import parse_quantity
from hsv.model.actuators import IDEAL
from hsv_paper.claims import numbers
from hsv_paper.claims.evidence import Evidence, certified, shown, worst

Vehicle = Literal["uncertain", "nominal", "worst"]
Actuators = Literal["none", "ideal", "elevator_150", "elevator_50", "elevator_20"]

_AS_PAPER = ("", "none", IDEAL)
"""Names of actuators whose readings need no other evidence: no name, independent of actuators, and ideal."""

_VEHICLES = {"uncertain": "uncertain parameters", "nominal": "nominal vehicle", "worst": "worst corner"}

_TABLE = parse_yaml(files(__package__).joinpath("claims.yaml").read_text(encoding="utf-8"))

THRESHOLDS = {
    name: parse_quantity(value, unit, name) if unit else float(value)
    for name, (value, unit) in _TABLE.pop("thresholds").items()
}
"""Thresholds (SI) by name that several claims share."""


class Verdict(StrEnum):
    """Verdict on a claim."""

    HOLDS = "holds"
    CONDITIONS = "holds under conditions"
    FAILS = "does not hold"


@dataclass(frozen=True)
class Reading:
    """One way to read a claim: a number (SI) that must be at most, or at least, a threshold."""

    what: str
    value: float
    unit: str
    at_most: float | None = None
    at_least: float | None = None
    actuators: str = ""
    """Name of the actuators between command and vehicle; empty if the claim names none, which means the paper's."""

    def measured(self) -> str:
        """Return the number with its unit, with so many digits that rounding does not hide a violated threshold."""
        written = (shown(self.value, self.unit, digits) for digits in range(4, 18))
        return next(text for text in written if self.holds or not self.threshold().endswith(f" {text}"))

    def threshold(self) -> str:
        """Return the threshold as text, such as "at most 12 ft"."""
        word, limit = ("least", self.at_least) if self.at_most is None else ("most", self.at_most)
        return f"at {word} {shown(np.nan if limit is None else limit, self.unit)}"

    @property
    def holds(self) -> bool:
        """Whether the number satisfies the threshold; NaN never does."""
        if self.at_most is not None:
            return bool(self.value <= self.at_most)
        return bool(self.at_least is not None and self.value >= self.at_least)


@dataclass(frozen=True)
class Finding:
    """A claim with its measured readings.

    The first ``leading`` readings are the statement itself under the paper's own conditions, one for each number in it.
    The others repeat it under further conditions.
    """

    claim: Claim
    readings: tuple[Reading, ...]
    leading: int = 1

    @property
    def verdict(self) -> Verdict:
        """The verdict: the claim holds in all readings, in all leading ones only, or not even in all of these."""
        kept = [reading.holds for reading in self.readings]
        if not all(kept[: self.leading]):
            return Verdict.FAILS
        return Verdict.HOLDS if all(kept) else Verdict.CONDITIONS


class Row(BaseModel, frozen=True, extra="forbid"):
    """A row of ``claims.yaml``: quantity, vehicles and threshold of readings; the file's head explains the fields."""

    what: str
    flight: str = ""
    measure: str = ""
    over: str = ""
    changes: dict[str, str | float] = {}
    certificate: str = ""
    number: str = ""
    vehicle: Vehicle | None = None
    vehicles: tuple[Vehicle, ...] = ("uncertain", "nominal", "worst")
    beyond: float | str | None = None
    unit: str = "1"
    at_most: float | str | None = None
    at_least: float | str | None = None
    lead: int = 0
    actuators: tuple[Actuators, ...] | None = None


class Claim(BaseModel, frozen=True, extra="forbid"):
    """A claim of ``claims.yaml``: its quote, its location in the paper, and the rows of its readings."""

    name: str
    quote: str
    location: str
    why: str
    readings: tuple[Row, ...]
    numbers: str = ""
    actuators: tuple[Actuators, ...] = ()

    def measure(self, evidence: Evidence) -> Finding:
        """Measure and return all readings of the claim, the leading ones first."""
        measured = self._measured(evidence)
        behind = {
            name: measured if name in _AS_PAPER else self._measured(evidence.behind(name))
            for name in {name for row in self.readings for name in self._actuators(row)}
        }
        first: list[Reading] = []
        further: list[Reading] = []
        leads = [row.lead for row in self.readings]
        for row, lead in zip(self.readings, leads if any(leads) else [1, *leads[1:]], strict=True):
            found = [
                reading
                for name in self._actuators(row)
                for reading in behind[name].readings(row, row.what.format_map(behind[name].numbers), name)
            ]
            first += found[:lead]
            further += found[lead:]
        return Finding(self, (*first, *further), sum(leads) or 1)

    def _actuators(self, row: Row) -> tuple[str, ...]:
        return (self.actuators or ("",)) if row.actuators is None else row.actuators

    def _measured(self, evidence: Evidence) -> _Measured:
        found = getattr(numbers, self.numbers)(evidence) if self.numbers else {}
        vehicles = len(evidence.over)
        return _Measured(evidence, {"vehicles": vehicles, "corners": vehicles - 1, **found})


@dataclass(frozen=True)
class _Measured:
    """The evidence for a claim, and by name the ``numbers`` that the claim's function returns from this evidence."""

    evidence: Evidence
    numbers: dict[str, Any]

    def readings(self, row: Row, what: str, actuators: str) -> list[Reading]:
        """Return a row's readings: one per ``vehicles``; a single one with ``vehicle``, ``beyond`` or no flight."""
        most, least = (None if limit is None else self.named(limit) for limit in (row.at_most, row.at_least))
        if row.vehicle or not row.flight or row.beyond is not None:
            asked = {what: row.vehicle or "nominal"}
        else:
            asked = {f"{what}, {_VEHICLES[vehicle]}": vehicle for vehicle in row.vehicles}
        return [
            Reading(text, self.value(row, vehicle), row.unit, most, least, actuators) for text, vehicle in asked.items()
        ]

    def named(self, limit: float | str) -> float:
        """Return the value of a limit, given as a number, or as the name of a threshold or of one of ``numbers``."""
        if isinstance(limit, str):
            return float(self.numbers[limit] if limit in self.numbers else THRESHOLDS[limit])
        return limit

    def value(self, row: Row, vehicle: Vehicle) -> float:
        """Return the number (SI) that a row measures for a kind of vehicle: uncertain, nominal or worst.

        The worst value over all vehicles is the smallest if the row has ``at_least``, else the largest, which is
        infinite if any is NaN. Unless uncertain, ``beyond`` means the number of vehicles whose value is larger or NaN.
        """
        if vehicle == "uncertain":
            return float(self._of_flights(row, self.evidence.uncertain))
        if row.flight:
            values = self._of_flights(row, self.evidence.magnitudes)
        else:
            values = self.numbers[row.number] if row.number else certified(row.certificate)
        values = np.atleast_1d(values)
        if row.beyond is not None:
            return float(np.count_nonzero(~(values <= self.named(row.beyond))))
        if vehicle == "nominal":
            return float(values[0])
        return float(values.min()) if row.at_least is not None else worst(values)

    def _of_flights(self, row: Row, measured: Callable[..., Any]) -> Any:
        values = measured(row.flight, row.measure, *row.changes.items())
        return values / measured(row.over, row.measure) if row.over else values


GROUPS = {group: tuple(map(Claim.model_validate, claims)) for group, claims in _TABLE.items()}
"""All claims, grouped by part of the paper and topic."""


def judge(evidence: Evidence, progress: Progress = lambda what, done, total: None) -> dict[str, list[Finding]]:
    """Measure all claims and return their findings by group."""
    judged: dict[str, list[Finding]] = {}
    for done, (group, claims) in enumerate(GROUPS.items()):
        progress("claims", done, len(GROUPS))
        judged[group] = [claim.measure(evidence) for claim in claims]
    progress("claims", len(GROUPS), len(GROUPS))
    return judged

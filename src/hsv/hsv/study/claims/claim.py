"""A statement of the paper, turned into numbers with thresholds as ``claims.toml`` says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from hsv.study.claims import thresholds
from hsv.study.claims.evidence import Evidence
from hsv.study.claims.finding import Finding, Reading, shown

Vehicle = Literal["uncertain", "nominal", "worst"]

_VEHICLES = {"uncertain": "uncertain parameters", "nominal": "nominal vehicle", "worst": "worst corner"}


class Row(BaseModel, frozen=True, extra="forbid"):
    """What is measured, on which vehicles, and what it is to keep to; the fields are explained in ``claims.toml``."""

    what: str = ""
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


class Claim(BaseModel, frozen=True, extra="forbid"):
    """A statement, word for word, where it stands, and how it is measured: a claim of ``claims.toml``."""

    name: str
    quote: str
    location: str
    why: str
    readings: tuple[Row, ...]
    facts: dict[str, Row] = {}
    numbers: str = ""

    def measure(self, evidence: Evidence) -> Finding:
        """Return the readings, those that lead first, and the reasons with their numbers."""
        module, _, name = self.numbers.partition(".")
        found = getattr(import_module(f"hsv.study.claims.{module}"), name)(evidence) if name else {}
        measured = _Measured(evidence, {"vehicles": evidence.vehicles, "corners": evidence.vehicles - 1, **found})
        words = measured.numbers | {name: measured.fact(row) for name, row in self.facts.items()} | vars(thresholds)
        rows = [measured.readings(row, row.what.format_map(words)) for row in self.readings]
        leads = [row.lead for row in self.readings]
        if not any(leads):
            leads[0] = 1
        first = [reading for row, lead in zip(rows, leads, strict=True) for reading in row[:lead]]
        further = [reading for row, lead in zip(rows, leads, strict=True) for reading in row[lead:]]
        return Finding((*first, *further), self.why.format_map(words), sum(leads))


@dataclass(frozen=True)
class _Measured:
    """The numbers of a claim's function by name, and what its rows read beside them."""

    evidence: Evidence
    numbers: dict[str, Any]

    def readings(self, row: Row, what: str) -> list[Reading]:
        """Return the readings of a row: one, or one a vehicle."""
        limits = [None if limit is None else self.named(limit) for limit in (row.at_most, row.at_least)]
        if row.vehicle or not row.flight or row.beyond is not None:
            return [Reading(what, self.value(row, row.vehicle or "nominal"), row.unit, *limits)]
        return [
            Reading(f"{what}, {_VEHICLES[vehicle]}", self.value(row, vehicle), row.unit, *limits)
            for vehicle in row.vehicles
        ]

    def fact(self, row: Row) -> _Fact:
        """Return what a row measures, for the words."""
        return _Fact(self.value(row, row.vehicle or "nominal"), row.unit)

    def named(self, limit: float | str) -> float:
        """Return a limit that is a number or the name of one."""
        if isinstance(limit, str):
            return float(self.numbers[limit] if limit in self.numbers else getattr(thresholds, limit))
        return limit

    def value(self, row: Row, vehicle: Vehicle) -> float:
        """Return the number (SI) of a row for a vehicle; ``worst``: infinite where a lost flight does not define it."""
        if vehicle == "uncertain":
            return self._of_flights(row, self.evidence.uncertain)
        if row.flight:
            values = self._of_flights(row, self.evidence.magnitudes)
        else:
            values = self.numbers[row.number] if row.number else self.evidence.certified(row.certificate)
        values = np.atleast_1d(values)
        if row.beyond is not None:
            return float(np.count_nonzero(~(values <= self.named(row.beyond))))
        if vehicle == "nominal":
            return float(values[0])
        if row.at_least is not None:
            return float(values.min())
        return float(np.inf) if np.any(np.isnan(values)) else float(values.max())

    def _of_flights(self, row: Row, measured: Callable[..., Any]) -> Any:
        values = measured(row.flight, row.measure, *row.changes.items())
        return values / measured(row.over, row.measure) if row.over else values


@dataclass(frozen=True)
class _Fact:
    """A number (SI) in words: in the paper's unit, or as the format says."""

    value: float
    unit: str

    def __format__(self, spec: str) -> str:
        return format(self.value, spec) if spec else shown(self.value, self.unit)


@dataclass(frozen=True)
class Judged:
    """A claim with its finding."""

    claim: Claim
    finding: Finding

"""A statement of the paper and the numbers and thresholds that judge it, as specified in ``claims.toml``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from hsv.model.actuators import IDEAL
from hsv_paper.claims import thresholds
from hsv_paper.claims.evidence import Evidence
from hsv_paper.claims.finding import Finding, Reading, shown

Vehicle = Literal["uncertain", "nominal", "worst"]
Actuators = Literal["none", "ideal", "elevator_150", "elevator_50", "elevator_20"]

_AS_PAPER = ("", "none", IDEAL)
"""Readings with the paper's actuators: none named, independent of actuators, and ideal."""

_VEHICLES = {"uncertain": "uncertain parameters", "nominal": "nominal vehicle", "worst": "worst corner"}


class Row(BaseModel, frozen=True, extra="forbid"):
    """Quantity of a reading, its vehicles and its threshold; the fields are explained in ``claims.toml``."""

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
    actuators: tuple[Actuators, ...] | None = None


class Claim(BaseModel, frozen=True, extra="forbid"):
    """A claim of ``claims.toml``: quote, location in the paper, and how it is measured."""

    name: str
    quote: str
    location: str
    why: str
    readings: tuple[Row, ...]
    facts: dict[str, Row] = {}
    numbers: str = ""
    actuators: tuple[Actuators, ...] = ()

    def measure(self, evidence: Evidence) -> Finding:
        """Return the readings, those of the statement itself first, and the explanation with its numbers."""
        measured = self._measured(evidence)
        words = measured.numbers | {name: measured.fact(row) for name, row in self.facts.items()} | vars(thresholds)
        behind = {
            name: measured if name in _AS_PAPER else self._measured(evidence.behind(name)) for name in self._named()
        }
        rows = [
            [
                reading
                for name in self._of(row)
                for reading in behind[name].readings(row, row.what.format_map(words | behind[name].numbers), name)
            ]
            for row in self.readings
        ]
        leads = [row.lead for row in self.readings]
        if not any(leads):
            leads[0] = 1
        first = [reading for row, lead in zip(rows, leads, strict=True) for reading in row[:lead]]
        further = [reading for row, lead in zip(rows, leads, strict=True) for reading in row[lead:]]
        return Finding((*first, *further), self.why.format_map(words), sum(leads))

    def _of(self, row: Row) -> tuple[str, ...]:
        return (self.actuators or ("",)) if row.actuators is None else row.actuators

    def _named(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(name for row in self.readings for name in self._of(row)))

    def _measured(self, evidence: Evidence) -> _Measured:
        module, _, name = self.numbers.partition(".")
        found = getattr(import_module(f"hsv_paper.claims.{module}"), name)(evidence) if name else {}
        return _Measured(evidence, {"vehicles": evidence.vehicles, "corners": evidence.vehicles - 1, **found})


@dataclass(frozen=True)
class _Measured:
    """The numbers of a claim's function by name, and the evidence from which its rows are measured."""

    evidence: Evidence
    numbers: dict[str, Any]

    def readings(self, row: Row, what: str, actuators: str = "") -> list[Reading]:
        """Return the readings of a row: one, or one per vehicle."""
        at_most, at_least = (None if limit is None else self.named(limit) for limit in (row.at_most, row.at_least))
        if row.vehicle or not row.flight or row.beyond is not None:
            asked = {what: row.vehicle or "nominal"}
        else:
            asked = {f"{what}, {_VEHICLES[vehicle]}": vehicle for vehicle in row.vehicles}
        return [
            Reading(text, self.value(row, vehicle), row.unit, at_most, at_least, actuators)
            for text, vehicle in asked.items()
        ]

    def fact(self, row: Row) -> _Fact:
        """Return the measured quantity of a row, for the explanation."""
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
    """A number (SI) for a text: in the paper's unit, or formatted as its format specifies."""

    value: float
    unit: str

    def __format__(self, spec: str) -> str:
        return format(self.value, spec) if spec else shown(self.value, self.unit)


@dataclass(frozen=True)
class Judged:
    """A claim with its finding."""

    claim: Claim
    finding: Finding

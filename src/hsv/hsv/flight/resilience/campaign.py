"""Definition of a resilience campaign: controllers, each in its own scenario, by faults and times of occurrence."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import tomli_w

from hsv.base.errors import CampaignError, one_of
from hsv.base.units import rounded, written
from hsv.control.library import library_digest
from hsv.flight.assembly import blamed_on, design_parameters
from hsv.flight.campaign.run import Batch
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.corners import screening_corners
from hsv.flight.resilience.faults import OBSERVED, TRIED, Moment, TriedFault
from hsv.flight.scenario import PERIOD, Scenario, load_scenario, parse_scenario, scenario_table, scenario_text

CONTROLLERS = ("case1", "case2", "case1_qp", "case1_integral_heavy", "case1_rmpc")
"""Scenarios flown by default: nested gains, adjustable factor, quadratic programme, integral action, robust MPC."""

_EVERY = 8
"""Stride in the list of screening corners; it selects two corners and their mirror images."""


@dataclass(frozen=True)
class Subject:
    """A controller in its scenario, with everything that its flights depend on, and its vehicles."""

    name: str
    text: str
    """The scenario, with everything that it extends"""
    design: Mapping[str, Any]
    """Flat parameters of the controller's design"""
    library: str
    """SHA-256 of the controller's shared library; empty if it has none"""
    vehicles: tuple[Mapping[str, float], ...]
    """Relative changes of the vehicle's parameters, the nominal vehicle first"""

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario without a fault of the campaign."""
        return parse_scenario(self.text, self.name)

    def start(self, moment: Moment) -> float:
        """Return the start (s) of a fault."""
        return rounded(moment.share * self.scenario.duration)

    def file(self, moment: Moment, vehicle: int, fault: TriedFault | None = None, value: float = 0.0) -> str:
        """Return the scenario of a flight as a file: it ends :data:`OBSERVED` after the start of its only fault.

        The changes of the numbered ``vehicle`` replace those of the scenario. Without a fault, it is the flight with
        which the others are compared.
        """
        table = scenario_table(self.text, self.name)
        start = self.start(moment)
        period = self.design.get("period", PERIOD)
        steps = round((start + OBSERVED * self.scenario.duration) / period)
        table["duration"] = written(rounded(steps * period), "s")
        table.pop("limits", None)  # they hold for the flight without these faults
        changes = {name: f"{100.0 * change!r} %" for name, change in self.vehicles[vehicle].items()}
        table["vehicle"] = {**table.get("vehicle", {}), "perturbation": changes}
        table["fault"] = [fault.row(value, start)] if fault else []
        return tomli_w.dumps(table)


@dataclass(frozen=True)
class Case:
    """A fault of one controller at one time: a batch with all severities and vehicles, and the bisection."""

    subject: Subject
    fault: str
    moment: Moment
    kind: int = 0
    """Number of the subject in the campaign"""

    @property
    def flights(self) -> int:
        """Number of flights, without those of the bisection."""
        return len(TRIED[self.fault].values) * len(self.subject.vehicles)

    @property
    def label(self) -> str:
        """Name of the case in its campaign."""
        return f"{self.subject.name}_{self.fault}_{self.moment.name}"

    @property
    def text(self) -> str:
        """Everything that the flights depend on except the code, as JSON."""
        values = {"subject": asdict(self.subject), "fault": asdict(TRIED[self.fault]), "moment": self.moment.name}
        return json.dumps(values, sort_keys=True)


@dataclass(frozen=True)
class ResilienceCampaign:
    """Controllers by faults, each at every time of occurrence."""

    subjects: tuple[Subject, ...]
    faults: tuple[str, ...]
    """Names in :data:`hsv.flight.resilience.faults.TRIED`."""

    @property
    def batches(self) -> list[Batch]:
        """A batch for each case."""
        return [Batch(case.label, case.flights) for case in self.cases]

    @cached_property
    def cases(self) -> list[Case]:
        """All cases, in a fixed order."""
        return [
            Case(subject, fault, moment, kind)
            for kind, subject in enumerate(self.subjects)
            for fault in self.faults
            for moment in Moment
        ]

    @property
    def text(self) -> str:
        """The campaign as JSON, the same text for the same campaign."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return the campaign written by :attr:`text`."""
        values = json.loads(text)
        subjects = tuple(
            Subject(**subject | {"vehicles": tuple(subject["vehicles"])}) for subject in values["subjects"]
        )
        return cls(subjects, tuple(values["faults"]))


def plan(controllers: Sequence[str], faults: Sequence[str]) -> ResilienceCampaign:
    """Return the campaign of controllers (scenarios, by name or path) and faults (names in :data:`TRIED`).

    Raises:
        CampaignError, ScenarioError: Names what is wrong.
    """
    for field, names in (("controllers", controllers), ("faults", faults)):
        if not names:
            raise CampaignError(f"{field}: none, expected at least one")
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise CampaignError(f"{field}: {twice!r} twice, expected each once")
    for name in faults:
        if name not in TRIED:
            raise CampaignError(f"faults = {name!r}: expected {one_of(TRIED, name)}")
    subjects = tuple(map(_subject, controllers))
    stems = [subject.name for subject in subjects]
    if twice := next((name for name in stems if stems.count(name) > 1), None):
        raise CampaignError(f"controllers: two files called {twice}, expected different names")
    return ResilienceCampaign(subjects, tuple(faults))


def _subject(name: str) -> Subject:
    scenario = load_scenario(name)
    with blamed_on(scenario):
        design, library = design_parameters(scenario), library_digest(scenario.controller)
    law = FlightVariants(scenario, design).unchanged.nominal_trajectory.law
    corners = screening_corners(scenario.vehicle.described.uncertainty)[::_EVERY]
    # A problem that is solved in flight takes about a hundred times as long.
    vehicles = corners if law.in_core else corners[:1]
    subject = Subject(Path(name).stem, scenario_text(name), design, library, tuple(vehicles))
    for moment in Moment:
        parse_scenario(subject.file(moment, 0), subject.name)
    return subject

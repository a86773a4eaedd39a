"""Definition of a resilience campaign: every controller, in its own scenario, meets every fault at every time."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, Self

import tomli_w

from hsv.base.errors import CampaignError, one_of
from hsv.base.units import rounded, written
from hsv.flight.assembly import blamed_on, design_parameters
from hsv.flight.campaign.run import Batch
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.corners import screening_corners
from hsv.flight.resilience.faults import OBSERVED, TRIED, Moment, TriedFault
from hsv.flight.scenario import PERIOD, Scenario, load_scenario, parse_scenario, scenario_table, scenario_text
from hsv.plugins.library import library_digest

CONTROLLERS = ("case1", "case2", "case1_qp", "case1_integral_heavy", "case1_rmpc")
"""Scenarios by default: nested gains, adjustable tube factor, quadratic programme, integral action, robust MPC."""

_EVERY = 8
"""Stride in the list of screening corners; it selects the nominal vehicle, two corners and their mirror images."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A controller under test: its scenario, its vehicles, and all else, except code, that its flights depend on."""

    name: str
    text: str
    """Text of the scenario file, including what it inherits by ``extends``"""
    design: Mapping[str, Any]
    """Parameters of the controller's design by name"""
    library: str
    """SHA-256 of the controller's shared library; empty if it has none"""
    vehicles: Sequence[Mapping[str, float]]
    """Relative changes of the uncertain parameters of each vehicle; the first vehicle is the nominal one"""

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario itself, with its own faults and without those of the campaign."""
        return parse_scenario(self.text, self.name)

    def start(self, moment: Moment) -> float:
        """Return the time (s) at which a fault with the time of occurrence ``moment`` starts."""
        return rounded(moment.share * self.scenario.duration)

    def file(self, moment: Moment, vehicle: int, fault: TriedFault | None = None, value: float = 0.0) -> str:
        """Return the text of a flight's scenario file, with one fault or none in place of the scenario's and no limits.

        After the start of the fault, the flight lasts for the share :data:`OBSERVED` of the scenario's duration.

        Args:
            moment: Time of occurrence of the fault; it also sets the duration of the flight without a fault.
            vehicle: Index in :attr:`vehicles`.
            fault: The fault; None for the flight with which the others are compared.
            value: Value of the parameter that is the severity of the fault.
        """
        table = scenario_table(self.text, self.name)
        start = self.start(moment)
        period = self.design.get("period", PERIOD)
        steps = round((start + OBSERVED * self.scenario.duration) / period)
        table["duration"] = written(rounded(steps * period), "s")
        for own in ("limits", "requirement"):  # of the scenario's own flight
            table.pop(own, None)
        changes = {name: f"{100.0 * change!r} %" for name, change in self.vehicles[vehicle].items()}
        table["vehicle"] = {**table.get("vehicle", {}), "perturbation": changes}
        table["fault"] = [fault.row(value, start)] if fault else []
        return tomli_w.dumps(table)


@dataclass(frozen=True)
class Case:
    """One controller with one fault at one time: all severities on all vehicles, a bisection on the nominal vehicle."""

    subject: Subject
    fault: str
    moment: Moment

    @property
    def flights(self) -> int:
        """Number of flights, not counting those of the bisection."""
        return len(TRIED[self.fault].values) * len(self.subject.vehicles)

    @property
    def label(self) -> str:
        """Name of the case, unique in its campaign."""
        return f"{self.subject.name}_{self.fault}_{self.moment.name}"

    @property
    def text(self) -> str:
        """JSON with everything, except the code, that the flights depend on."""
        values = {"subject": asdict(self.subject), "fault": asdict(TRIED[self.fault]), "moment": self.moment.name}
        return json.dumps(values, sort_keys=True)


@dataclass(frozen=True)
class ResilienceCampaign:
    """A resilience campaign: every controller meets every fault at every time of occurrence."""

    subjects: tuple[Subject, ...]
    faults: tuple[str, ...]
    """Names in :data:`hsv.flight.resilience.faults.TRIED`."""

    @property
    def batches(self) -> list[Batch]:
        """One batch per case, in the order of :attr:`cases`."""
        return [Batch(case.label, case.flights) for case in self.cases]

    @cached_property
    def cases(self) -> list[Case]:
        """All cases: for each controller, each fault at each time."""
        return [Case(*each) for each in product(self.subjects, self.faults, Moment)]

    @property
    def text(self) -> str:
        """The campaign as JSON; equal campaigns have equal texts."""
        return json.dumps(asdict(self), sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Return the campaign from its JSON ``text``, the inverse of :attr:`text`."""
        values = json.loads(text)
        return cls(tuple(Subject(**subject) for subject in values["subjects"]), tuple(values["faults"]))


def plan(controllers: Sequence[str], faults: Sequence[str]) -> ResilienceCampaign:
    """Return the campaign of controllers (scenarios, by name or path) and faults (names in :data:`TRIED`).

    Raises:
        CampaignError, ScenarioError: An argument is wrong; the message names it.
    """
    for field, names in (("controllers", controllers), ("faults", faults)):
        if not names:
            raise CampaignError(f"{field}: none, expected at least one")
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise CampaignError(f"{field}: {twice!r} twice, expected no duplicates")
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
    # A law that solves a problem in flight flies the nominal vehicle only: its flights take about 100 times as long.
    vehicles = corners if law.in_core else corners[:1]
    subject = Subject(Path(name).stem, scenario_text(name), design, library, tuple(vehicles))
    for moment in Moment:
        parse_scenario(subject.file(moment, 0), subject.name)
    return subject

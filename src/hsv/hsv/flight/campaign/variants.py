"""Components of flights that are variants of one flight; components that do not differ are built once and shared."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from typing import Any

from hsv.base.errors import CampaignError
from hsv.control.controller import SHIPPED_CONTROLLERS
from hsv.control.design import design_of
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.core import lanes
from hsv.flight.assembly import (
    assemble,
    assemble_flight,
    blamed_on,
    check_times,
    design_parameters,
    scenario_parameters,
)
from hsv.flight.closed_loop import Components, fly
from hsv.flight.flight import Flight
from hsv.flight.scenario import Scenario
from hsv.flight.side_by_side import FlightGroup
from hsv.model.faults.injector import FaultInjector
from hsv.model.plant import PLANT_PARAMETERS, Plant
from hsv.model.trim import initial_trim
from hsv.plugins.controllers import HIDDEN_PARAMETERS
from hsv.plugins.library import library_digest

_NOT_OF_SHIPPED = (*HIDDEN_PARAMETERS, "initial.", "reference.")
"""Prefixes of the parameters on which the shipped controllers do not depend."""

_PERTURBATION = "vehicle.perturbation."

_CHANGES = {p.name.removeprefix(_PERTURBATION): p for p in PLANT_PARAMETERS if p.name.startswith(_PERTURBATION)}
"""Declarations of the relative changes ``vehicle.perturbation.*``, by the name of the vehicle's parameter."""


def fly_variants(scenarios: Iterable[Scenario]) -> Iterator[Flight]:
    """Fly ``scenarios``, most of which are variants of the first, in order and side by side where possible.

    Raises:
        ScenarioError: A field or the design is wrong; the message names it.
        RunError: A custom controller failed.
    """
    given = iter(scenarios)
    kind, variants = None, None
    while some := [*islice(given, lanes())]:
        built = []
        for scenario in some:
            if variants is None or kind != (scenario.design, scenario.controller):
                kind = scenario.design, scenario.controller
                with blamed_on(scenario):
                    design = design_parameters(scenario)
                variants = FlightVariants(scenario, design)
            with blamed_on(scenario):
                built.append(variants.components(scenario))
                check_times(scenario, built[-1])
        # A group of its own for each, because the flights may be kept.
        yield from (each for each, _ in FlightGroup().fly(built)) if FlightGroup.takes(built) else map(fly, built)


class FlightVariants:
    """Builds the components of variants of one flight, all with the same design."""

    def __init__(self, scenario: Scenario, design: Mapping[str, Any], library: str | None = None) -> None:
        """Assemble the flight of a scenario; ``design`` has all parameters of the controller's design, by name.

        ``library`` is the expected SHA-256 of the controller's shared library, empty without one; None skips the check.
        """
        if library is not None and library_digest(scenario.controller) != library:
            raise CampaignError(
                f"controller = {scenario.controller!r}: not the library that the campaign began with, expected the one "
                f"of SHA-256 {library}"
            )
        self._parameters = dict(design)
        self._design = design_of(design)
        self.unchanged: Components = assemble_flight(scenario, self._design)
        """Components of the flight of the scenario itself"""
        self._nominal = {**design, **scenario_parameters(scenario)}
        self._kept_for = _NOT_OF_SHIPPED if scenario.controller in SHIPPED_CONTROLLERS else HIDDEN_PARAMETERS
        self._vehicle, _ = initial_trim(self._nominal)

    def components(self, scenario: Scenario) -> Components:
        """Return the components of a variant, given by its ``scenario``."""
        values = {**self._parameters, **scenario_parameters(scenario)}
        names = values.keys() | self._nominal.keys()
        changed = [name for name in names if values.get(name) != self._nominal.get(name)]
        if not all(name.startswith(self._kept_for) for name in changed):
            return assemble(values)
        trajectory = self.unchanged.nominal_trajectory
        if any(name.startswith("reference.") for name in changed):
            trajectory = NominalTrajectory.from_parameters(values, self._design)
        return replace(
            self.unchanged,
            plant=Plant.from_parameters(values),
            nominal_trajectory=trajectory,
            fault_injector=FaultInjector.from_parameters(values),
        )

    def perturbed(self, perturbation: Mapping[str, float], seed: int) -> Components | None:
        """Return the components of a variant that differs in the vehicle's parameters and the seed only.

        ``perturbation`` has the relative changes by parameter. Return None if one of them is not admissible; the
        caller can then build the variant from its scenario, which raises an error with the reason.
        """
        if not all(_CHANGES[name].admits(change) for name, change in perturbation.items()):
            return None
        vehicle = self._vehicle.perturbed(perturbation)
        return replace(
            self.unchanged,
            plant=self.unchanged.plant.varied(vehicle, seed),
            fault_injector=self.unchanged.fault_injector.with_seed(seed),
        )

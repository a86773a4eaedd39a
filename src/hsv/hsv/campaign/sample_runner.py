"""Flies the samples of a campaign one at a time; components that all flights share are built once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

from hsv.campaign.campaign import Campaign
from hsv.campaign.sampling import Sampler
from hsv.campaign.tube_levels import TubeLevels
from hsv.control.controller import Controller
from hsv.control.controllers import NOT_TOLD, SHIPPED_CONTROLLERS
from hsv.control.design import design_of
from hsv.control.library import library_digest
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.errors import CampaignError, ControllerError
from hsv.faults.injector import FaultInjector
from hsv.simulation.assembly import assemble, assemble_flight, scenario_parameters
from hsv.simulation.closed_loop import Flight, fly
from hsv.simulation.metrics import FlightData, flight_metrics
from hsv.vehicle.envelope import in_model_range
from hsv.vehicle.plant import Plant

Outcome = dict[str, float | bool | str | None]

_NOT_OF_SHIPPED = (*NOT_TOLD, "initial.", "reference.")
"""Beginnings of parameters on which the bench's own controllers do not depend."""


class SampleRunner:
    """Flies any flight of one campaign, alone or in any order, always with the same bits."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.sampler = Sampler(campaign)
        self.scenario = campaign.scenario
        if library_digest(self.scenario.controller) != campaign.library:
            raise CampaignError(
                f"controller = {self.scenario.controller!r}: not the library that the campaign began with, expected "
                f"the one of SHA-256 {campaign.library}"
            )
        self._nominal = campaign.parameters
        self._design = design_of(campaign.design)
        self._parts = assemble_flight(self.scenario, self._design)
        self._levels = TubeLevels(self._parts)
        self._kept_for = _NOT_OF_SHIPPED if self.scenario.controller in SHIPPED_CONTROLLERS else NOT_TOLD
        self.period = self._parts.plant.period
        """Control period, s."""
        self.steps = self._parts.plant.steps
        """Control periods of a flight that does not end early."""

    def sample(self, flight: int) -> list[float]:
        """Return the sample of a flight (one value a factor)."""
        [sample], _ = self.sampler.draw(range(flight, flight + 1))
        return list(sample.tolist())

    def fly(self, flight: int, sample: Sequence[float]) -> Flight:
        """Fly a flight with its sample (one value a factor)."""
        parts = self._parts
        values = {**self.campaign.design, **scenario_parameters(self.campaign.flown(flight, sample))}
        names = values.keys() | self._nominal.keys()
        changed = [name for name in names if values.get(name) != self._nominal.get(name)]
        if not all(name.startswith(self._kept_for) for name in changed):
            return fly(assemble(values))
        trajectory = parts.nominal_trajectory
        if any(name.startswith("reference.") for name in changed):
            trajectory = NominalTrajectory.from_parameters(values, self._design)
        return fly(
            replace(
                parts,
                plant=Plant.from_parameters(values),
                nominal_trajectory=trajectory,
                fault_injector=FaultInjector.from_parameters(values),
            )
        )

    def fly_unchanged(self) -> Flight:
        """Fly the scenario itself."""
        return fly(self._parts)

    @property
    def controller(self) -> Controller:
        """The controller that flies."""
        return self._parts.controller

    def outcome(self, flight: FlightData, fingerprint: str | None) -> Outcome:
        """Return what a campaign records of a flight: its end, worst tube level, metrics (SI), ``fingerprint``."""
        return {
            "diverged": not in_model_range(flight.state[-1], self._parts.plant.vehicle.angle_limit),
            "end_time": float(flight.time[-1]),
            "tube_level": self._levels.worst(flight),
            **flight_metrics(flight),
            "crashed": None,
            "fingerprint": fingerprint,
        }

    def crashed(self, error: ControllerError) -> Outcome:
        """Return the outcome of a flight that its controller ended: the reason, and no metrics."""
        return {"diverged": False, "crashed": str(error)}


@lru_cache(maxsize=1)
def sample_runner(text: str) -> SampleRunner:
    """Return the sample runner of the campaign written in ``text``; a worker process caches the last one."""
    return SampleRunner(Campaign.from_text(text))

"""Flies the samples of a campaign; components that all flights share are built once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from hsv.base.errors import CampaignError, ControllerError, ScenarioError
from hsv.control.controller import Controller
from hsv.control.library import library_digest
from hsv.core import lanes
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.flight_reader import FlightReader, FlightReading
from hsv.flight.campaign.sampling import Sampler
from hsv.flight.campaign.tube_levels import TubeLevels
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import Components, fly
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightData, flight_metrics
from hsv.flight.side_by_side import FlightGroup
from hsv.model.dynamics import in_model_range

Outcome = dict[str, float | bool | str | None]


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
        self._variants = FlightVariants(self.scenario, campaign.design)
        parts = self._variants.unchanged
        self._levels = TubeLevels(parts)
        self.period = parts.plant.period
        """Control period, s."""
        self.steps = parts.plant.steps
        """Control periods of a flight that does not end early."""

    def sample(self, flight: int) -> list[float]:
        """Return the sample of a flight (one value a factor)."""
        [sample], _ = self.sampler.draw(range(flight, flight + 1))
        return list(sample.tolist())

    def fly(self, flight: int, sample: Sequence[float]) -> Flight:
        """Fly a flight with its sample (one value a factor).

        Raises:
            ControllerError: A controller of one's own ended it.
            ScenarioError: The scenario does not admit the values of the flight together; it is named.
        """
        return fly(self._components(flight, sample))

    def fly_all(self, flights: Sequence[int], samples: np.ndarray) -> Iterator[FlightReading | ControllerError]:
        """Fly ``flights`` with their ``samples`` (flights, factors), side by side where that can be.

        Each is valid until the next one. In place of a flight that its controller ended comes what it said.

        Raises:
            ScenarioError: As above.
        """
        width = lanes()
        for start in range(0, len(flights), width):
            drawn = zip(flights[start : start + width], samples[start : start + width], strict=True)
            components = [self._components(flight, sample) for flight, sample in drawn]
            if FlightGroup.takes(components):
                yield from self._reader.read(components)
            else:
                yield from map(self._flown_or_error, components)

    @cached_property
    def _reader(self) -> FlightReader:
        return FlightReader(self.steps, self._levels)  # whose memory is kept

    def _flown_alone(self, components: Components) -> FlightReading:
        flight = fly(components)
        data = flight.data()
        return FlightReading.of(data, self.level(data), flight.fingerprint)

    def _flown_or_error(self, components: Components) -> FlightReading | ControllerError:
        try:
            return self._flown_alone(components)
        except ControllerError as error:
            return error

    def _components(self, flight: int, sample: Sequence[float]) -> Components:
        if names := self.campaign.perturbed:
            drawn = dict(zip(names, map(float, sample), strict=True))
            perturbation = {**self.scenario.vehicle.perturbation, **drawn}
            if components := self._variants.perturbed(perturbation, self.campaign.flight_seed(flight)):
                return components
        try:
            return self._variants.components(self.campaign.flown(flight, sample))
        except ScenarioError as error:
            raise ScenarioError(f"flight {flight}: {error}") from error

    def fly_unchanged(self) -> Flight:
        """Fly the scenario itself."""
        return fly(self._variants.unchanged)

    def fly_piece(self, steps: int) -> list[FlightReading]:
        """Fly so many ``steps`` of the scenario itself, as often as it is flown at once.

        Raises:
            ControllerError: As :meth:`fly`.
        """
        parts = self._variants.unchanged
        plant = copy(parts.plant)
        plant.steps = steps
        pieces = [replace(parts, plant=plant)] * lanes()
        if not FlightGroup.takes(pieces):
            return [self._flown_alone(pieces[0])]
        return FlightReader(steps, self._levels).read(pieces)

    @property
    def controller(self) -> Controller:
        """The controller that flies."""
        return self._variants.unchanged.controller

    def level(self, flight: FlightData) -> float | None:
        """Return the worst level of a flight in the tube, ``None`` where no set holds for it."""
        return self._levels.worst(flight)

    def outcome(self, flown: FlightReading) -> Outcome:
        """Return what a campaign records of a flight: its end, worst tube level, metrics (SI), fingerprint."""
        return {
            "diverged": not in_model_range(flown.last, self._variants.unchanged.plant.vehicle.angle_limit),
            "end_time": float(flown.curves.time[-1]),
            "tube_level": flown.level,
            **flight_metrics(flown.curves),
            "crashed": None,
            "fingerprint": flown.fingerprint,
        }

    def crashed(self, error: ControllerError) -> Outcome:
        """Return the outcome of a flight that its controller ended: the reason, and no metrics."""
        return {"diverged": False, "crashed": str(error)}


@lru_cache(maxsize=1)
def sample_runner(text: str) -> SampleRunner:
    """Return the sample runner of the campaign written in ``text``; a worker process caches the last one."""
    return SampleRunner(Campaign.from_text(text))

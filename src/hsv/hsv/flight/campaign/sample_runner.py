"""The flights of a campaign: shared components are built once, and metrics are computed while the flights run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from hsv.base.errors import ControllerError, ScenarioError
from hsv.control.controller import Controller
from hsv.control.library import LibraryController
from hsv.core import lanes
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.table import encode
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import Components, fly, watched
from hsv.flight.flight import Flight
from hsv.flight.metrics import FlightCurves, FlightData, flight_metrics
from hsv.flight.side_by_side import FlightGroup, TubeLevels
from hsv.model.dynamics import in_model_range

Outcome = dict[str, float | bool | str | None]


class FlightReading(NamedTuple):
    """The results of a flight that a campaign needs; the history itself is not kept."""

    curves: FlightCurves
    last: np.ndarray
    """Last state x (9)"""
    level: float | None
    """Largest level in the tube's invariant set; None if no set holds for the flight"""
    fingerprint: str | None

    @classmethod
    def of(cls, data: FlightData, level: float | None, fingerprint: str | None) -> Self:
        """Return the reading of a flight whose whole history is in memory."""
        return cls(data.flight_curves, data.state[-1], level, fingerprint)


class SampleRunner:
    """Flies any flight of one campaign, alone or in any order, always with the same bits."""

    def __init__(self, campaign: Campaign) -> None:
        self.campaign = campaign
        self.scenario = campaign.scenario
        self._variants = FlightVariants(self.scenario, campaign.design, campaign.library)
        parts = self._variants.unchanged
        self._levels = TubeLevels(parts)
        self._group = FlightGroup()
        self.period = parts.plant.period
        """Control period, s"""
        self.steps = parts.plant.steps
        """Control periods of a flight that does not end early"""

    @property
    def controller(self) -> Controller:
        """The controller of all flights."""
        return self._variants.unchanged.controller

    def sample(self, flight: int) -> list[float]:
        """Return the sample of a flight (one value a factor)."""
        [sample], _ = self.campaign.draw(range(flight, flight + 1))
        return list(sample.tolist())

    def fly(self, flight: int, sample: Sequence[float]) -> Flight:
        """Fly a flight with its sample (one value a factor).

        Raises:
            ControllerError: A custom controller failed.
            ScenarioError: The scenario does not admit the values of the flight together; the flight is named.
        """
        return fly(self._components(flight, sample))

    def fly_all(self, flights: Sequence[int], samples: np.ndarray) -> Iterator[FlightReading | ControllerError]:
        """Fly ``flights`` with their ``samples`` (flights, factors), side by side if possible.

        Each reading is valid until the next one. A controller that fails yields its error in place of the reading.
        """
        width = lanes()
        for start in range(0, len(flights), width):
            drawn = zip(flights[start : start + width], samples[start : start + width], strict=True)
            components = [self._components(flight, sample) for flight, sample in drawn]
            if FlightGroup.takes(components):
                for flight, level in self._group.fly(components, self._levels.set):
                    known = level if self._levels.set else None
                    yield FlightReading(flight.curves, flight.history.state[-1], known, flight.fingerprint)
            else:
                yield from map(self._read_alone, components)

    def fly_unchanged(self) -> Flight:
        """Fly the scenario itself."""
        return fly(self._variants.unchanged)

    def level(self, flight: FlightData) -> float | None:
        """Return the largest level of a flight in the tube, None if no set holds for it."""
        return self._levels.worst(flight)

    def outcome(self, flown: FlightReading | ControllerError) -> Outcome:
        """Return the row of a flight: its end, tube level, metrics (SI) and fingerprint, or the controller's error."""
        if isinstance(flown, ControllerError):
            return {"diverged": False, "crashed": str(flown)}
        return {
            "diverged": not in_model_range(flown.last, self._variants.unchanged.plant.vehicle.angle_limit),
            "end_time": float(flown.curves.time[-1]),
            "tube_level": flown.level,
            **flight_metrics(flown.curves),
            "crashed": None,
            "fingerprint": flown.fingerprint,
        }

    def fly_batch(self, batch: int) -> bytes:
        """Fly a batch; return its rows and envelope as a Parquet file."""
        flights, envelope, rows = self.campaign.flights(batch), Envelope.empty(), []
        samples, seeds = self.campaign.draw(flights)
        for flight, sample, seed, flown in zip(flights, samples, seeds, self.fly_all(flights, samples), strict=True):
            if isinstance(flown, FlightReading):
                envelope.add(flown.curves, self.steps)
            drawn = {f"sample_{f.name}": float(x) for f, x in zip(self.campaign.factors, sample, strict=True)}
            rows.append({"flight": flight, "seed": int(seed), **drawn, **self.outcome(flown)})
        return encode(self.campaign, rows, envelope)

    def _read_alone(self, components: Components) -> FlightReading | ControllerError:
        try:
            flight = fly(components)
        except ControllerError as error:
            return error
        data = flight.data()
        return FlightReading.of(data, self.level(data), flight.fingerprint)

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


@lru_cache(maxsize=1)
def sample_runner(text: str) -> SampleRunner:
    """Return the sample runner of the campaign written in ``text``; a worker process keeps the last one."""
    return SampleRunner(Campaign.from_text(text))


def fly_batch(text: str, batch: int) -> bytes:
    """Fly a batch of the campaign written in ``text``, see :meth:`SampleRunner.fly_batch`.

    The flights run in the child process of the controller's library if there is one. If the library crashes, they are
    flown again, each with a child process of its own.
    """
    runner = sample_runner(text)
    if isinstance(runner.controller, LibraryController):
        with suppress(ControllerError), watched(runner.controller, runner.steps + 1) as (_, request):
            return bytes(request("call", _fly_batch, text, batch))
    return _fly_batch(text, batch)


def _fly_batch(text: str, batch: int) -> bytes:
    return sample_runner(text).fly_batch(batch)

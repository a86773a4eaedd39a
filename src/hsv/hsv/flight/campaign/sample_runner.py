"""The flights of a campaign: shared components are built once, and each flight becomes a row of a table."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from io import BytesIO
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsv.base.errors import ControllerError, ScenarioError
from hsv.control.controller import Controller
from hsv.core import lanes
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.variants import FlightVariants
from hsv.flight.closed_loop import Components, fly, watched
from hsv.flight.flight import Flight
from hsv.flight.metrics import METRICS, NOT_REACHED, FlightData
from hsv.flight.requirement import margins
from hsv.flight.scenario import Scenario
from hsv.flight.side_by_side import FlightGroup, TubeLevels
from hsv.model.dynamics import in_model_range
from hsv.plugins.library import LibraryController

CAMPAIGN, ENVELOPE, DIGEST = b"hsv.campaign", b"hsv.envelope", b"hsv.digest"
"""Keys in the metadata of a result file: the campaign, the envelope, and the digest of both."""

FORMAT, LATEST = b"hsv.format", b"2"
"""Key of the number of the file's format in its metadata, and the number; a file of release 0.1.0 has none."""

OUTCOMES = {"end_time": "s", "tube_level": "1", **{name: metric.unit for name, metric in METRICS.items()}}
"""Names of the numbers that are recorded of every flight, with their SI units; a number may be undefined (null)."""


def outcomes_of(scenario: Scenario) -> dict[str, str]:
    """Return :data:`OUTCOMES` and, with the unit 1, the margins of the requirements of ``scenario``."""
    return OUTCOMES | {requirement.metric: "1" for requirement in scenario.requirement}


WRITTEN: dict[str, Any] = {"compression": "zstd", "write_page_checksum": True}
"""Parquet options of the result file; its checksums detect damage that does not stop the decompression."""

_BATCH_WRITTEN: dict[str, Any] = {
    "compression": "none",
    "use_dictionary": False,
    "write_statistics": False,
    "write_page_checksum": True,
}
"""Parquet options of the file of a batch, which is read only once: compressing it takes longer than writing it."""


Outcome = dict[str, float | bool | str | None]


FlownSample = tuple[Flight, float | None] | ControllerError
"""A flight and its largest tube level (None if no invariant set applies to it), or the error of the controller."""


class SampleRunner:
    """Flies any flights of one campaign, in any order; their bits do not depend on the order."""

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
        """Number of control periods of a flight that does not end early"""

    @property
    def controller(self) -> Controller:
        """The controller of the scenario without samples; that of a flight may have other parameters."""
        return self._variants.unchanged.controller

    def fly(self, flight: int, sample: Sequence[float]) -> Flight:
        """Fly a flight with its sample, one value per factor."""
        return fly(self._components(flight, sample))

    def fly_all(self, flights: Sequence[int], samples: np.ndarray) -> Iterator[FlownSample]:
        """Fly ``flights`` with their ``samples``, shape (flights, factors), and yield the results in the same order.

        The flights are simulated side by side if possible. A result must be used before the next one is requested,
        because flights share memory.
        """
        width = lanes()
        for start in range(0, len(flights), width):
            drawn = zip(flights[start : start + width], samples[start : start + width], strict=True)
            components = [self._components(flight, sample) for flight, sample in drawn]
            if FlightGroup.takes(components):
                for flight, level in self._group.fly(components, self._levels.set):
                    yield flight, level if self._levels.set else None
            else:
                yield from map(self._fly_alone, components)

    def fly_unchanged(self) -> Flight:
        """Fly the scenario from which the samples deviate, with the mean in place of every distribution."""
        return fly(self._variants.unchanged)

    def tube_level(self, flight: FlightData) -> float | None:
        """Return the largest tube level of a flight, None if no invariant set applies to it."""
        return self._levels.worst(flight)

    def outcome(self, flown: FlownSample) -> Outcome:
        """Return a flight's results by column, or only how it ended if its controller crashed."""
        if isinstance(flown, ControllerError):
            lost = {requirement.metric: -math.inf for requirement in self.scenario.requirement}
            return {"diverged": False, "crashed": str(flown), **lost}
        flight, level = flown
        return self.measured(flight, level, flight.fingerprint)

    def measured(self, flight: FlightData, level: float | None, fingerprint: str | None) -> Outcome:
        """Return the results of a flight that did not crash, by column; ``level`` is its largest tube level."""
        vehicle = self._variants.unchanged.plant.vehicle
        diverged = not in_model_range(flight.history.state[-1], vehicle.angle_limit)
        required = margins(
            self.scenario.requirement,
            flight,
            ended=not diverged,
            levels=partial(self._levels.along, flight),
            largest_level=math.nan if level is None else level,
        )
        return {
            "diverged": diverged,
            "end_time": float(flight.time[-1]),
            "tube_level": level,
            **flight.metrics,
            **{name: margin.margin for name, margin in required.items()},
            "not_reached": " ".join(n for n, why in flight.missing.items() if why.startswith(NOT_REACHED)) or None,
            "crashed": None,
            "fingerprint": fingerprint,
        }

    def fly_batch(self, batch: int) -> bytes:
        """Fly a batch, given by its number; return the same as :meth:`table`."""
        flights = self.campaign.flights(batch)
        return self.table(flights, *self.campaign.draw(flights))

    def table(self, flights: range, samples: np.ndarray, seeds: np.ndarray | None = None) -> bytes:
        """Fly ``flights`` with their ``samples``, shape (flights, factors), and ``seeds``, by default the campaign's.

        Return the table of results and the envelope as a Parquet file.
        """
        envelope, outcomes = Envelope.empty(), []
        seeds = np.full(len(flights), self.campaign.seed, np.uint64) if seeds is None else seeds
        for flown in self.fly_all(flights, samples):
            outcomes.append(self.outcome(flown))
            if not isinstance(flown, ControllerError) and not outcomes[-1]["diverged"]:
                envelope.add(flown[0], self.steps)
        drawn = zip((f"sample_{factor.name}" for factor in self.campaign.factors), samples.T, strict=True)
        columns = {"flight": flights, "seed": seeds, **dict(drawn)}
        columns |= {
            name: [outcome.get(name) for outcome in outcomes]
            for name in ("diverged", "crashed", *outcomes_of(self.scenario), "not_reached", "fingerprint")
        }
        return encode(self.campaign, columns, envelope)

    def _fly_alone(self, components: Components) -> FlownSample:
        try:
            flight = fly(components)
        except ControllerError as error:
            return error
        return flight, self.tube_level(flight)

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


def schema(campaign: Campaign) -> pa.Schema:
    """Return the columns of the results: flight number, seed, sample, how and when it ended, metrics, fingerprint.

    ``not_reached`` has the names of the times that the flight did not reach, separated by spaces, or null.
    """
    samples = [_number(f"sample_{factor.name}", factor.unit) for factor in campaign.factors]
    outcomes = [_number(name, unit) for name, unit in outcomes_of(campaign.scenario).items()]
    fixed = [pa.field("flight", pa.int64(), False), pa.field("seed", pa.uint64(), False)]
    ended = [pa.field("diverged", pa.bool_(), False), pa.field("crashed", pa.string())]
    texts = [pa.field(name, pa.string()) for name in ("not_reached", "fingerprint")]
    return pa.schema([*fixed, *samples, *ended, *outcomes, *texts])


def _number(name: str, unit: str) -> pa.Field:
    return pa.field(name, pa.float64(), metadata={"unit": unit})


def encode(campaign: Campaign, columns: Mapping[str, Sequence[Any]], envelope: Envelope) -> bytes:
    """Return the columns (one value per flight) and the envelope of a batch as the content of a Parquet file."""
    fields = schema(campaign).with_metadata({ENVELOPE: envelope.encode()})
    table = pa.Table.from_arrays([_array(field.type, columns[field.name]) for field in fields], schema=fields)
    stream = BytesIO()
    pq.write_table(table, stream, **_BATCH_WRITTEN)
    return stream.getvalue()


def _array(kind: pa.DataType, values: Sequence[Any]) -> pa.Array:
    """Return an Arrow array of ``values``, some of which may be None.

    It is made of its buffers, because every conversion by pyarrow imports pandas, which takes longer than 50 flights.
    """
    buffers: list[np.ndarray | bytes] = [np.packbits([value is not None for value in values], bitorder="little")]
    if pa.types.is_string(kind):
        texts = [(value or "").encode() for value in values]
        buffers += [np.cumsum([0, *map(len, texts)], dtype=np.int32), b"".join(texts)]
    elif pa.types.is_boolean(kind):
        buffers.append(np.packbits(values, bitorder="little"))
    else:
        buffers.append(np.array([0 if value is None else value for value in values], kind.to_pandas_dtype()))
    return pa.Array.from_buffers(kind, len(values), [*map(pa.py_buffer, buffers)])


@lru_cache(maxsize=1)
def sample_runner(text: str) -> SampleRunner:
    """Return the sample runner of the campaign with this ``text``; the runner of the latest text is cached."""
    return SampleRunner(Campaign.from_text(text))


def fly_batch(text: str, batch: int) -> bytes:
    """Fly a batch of the campaign with this ``text``; return the same as :meth:`SampleRunner.fly_batch`.

    If the controller is in a shared library, the batch is flown in the child process that loads it. If the library
    crashes there, all flights of the batch are flown again one by one, in a new child process after each crash.
    """
    return in_child_of(sample_runner(text), _fly_batch, text, batch)


def in_child_of(runner: SampleRunner, job: Callable[[str, int], bytes], text: str, batch: int) -> bytes:
    """Return ``job(text, batch)``, called in the child process of the runner's shared library if it has one."""
    if isinstance(runner.controller, LibraryController):
        with suppress(ControllerError), watched(runner.controller, runner.steps + 1) as (_, request):
            return bytes(request("call", bytes, job, text, batch))
    return job(text, batch)


def _fly_batch(text: str, batch: int) -> bytes:
    return sample_runner(text).fly_batch(batch)

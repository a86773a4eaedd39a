"""Summary of a campaign: share of flights within each limit with its confidence interval, and the worst flights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from hsv.base.errors import CampaignError
from hsv.control.design import design_of
from hsv.flight.assembly import require_trust
from hsv.flight.campaign.campaign import SEARCHES, Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.sample_runner import SampleRunner, outcomes_of
from hsv.flight.campaign.store import read_result
from hsv.flight.metrics import METRICS, spaced
from hsv.plugins.controllers import names_code

if TYPE_CHECKING:
    from pandas import DataFrame

CONFIDENCE = 0.95

CRASHED, DIVERGED = ENDED = ("crashed", "diverged")
"""Reasons why a flight did not reach its end; :attr:`WorstFlight.limit` has them in place of a limit."""

_NAN = pa.Array.from_buffers(pa.float64(), 1, [None, pa.py_buffer(np.array([math.nan]))])[0]

_NEVER, _LATE = 1e200, 1e100
"""A number in place of an infinite one, and the magnitude above which a statistic is made of it."""

TUBE_LIMIT = 1.0
"""Tube level on the boundary of the invariant set."""


@dataclass(frozen=True)
class Share:
    """How many of the finished flights to which a limit applies keep it; with the limit None, how many flights finish.

    Lost flights, and those to which the limit does not apply, are in no share but the one without a limit.
    """

    name: str
    limit: float | None
    """The limit, SI"""
    within: int
    flights: int
    """Number of the flights that are judged"""
    interval: tuple[float, float] | None
    """Clopper-Pearson interval, from 0 to 1; None for corners, which are not a random sample, and without flights."""

    @property
    def fraction(self) -> float:
        """Share of the judged flights within the limit, from 0 to 1; NaN without flights."""
        return self.within / self.flights if self.flights else math.nan


@dataclass(frozen=True)
class WorstFlight:
    """One of the worst flights: ``ratio`` is the largest ratio of a metric to its limit, ``limit`` names this metric.

    The ratio of a requirement is 1 minus its margin, the share of the bound that the signal uses.

    If the flight did not finish, ``limit`` is ``crashed`` or ``diverged``, and ``ratio`` is infinite, as for a time
    that was not reached. Limits of 0 are ignored; if there are no others, ``ratio`` is 0 and ``limit`` is empty.
    ``sample`` is in SI units, by factor.
    """

    flight: int
    limit: str
    ratio: float
    sample: dict[str, float]


class Results:
    """The results of a campaign, read from its file; only :attr:`sample_runner` loads a controller."""

    def __init__(self, path: Path, *, trust: bool = False) -> None:
        """Read a result file; ``trust`` permits loading code that is named in it. Errors as for :func:`read_result`."""
        self.path = path
        self.trust = trust
        self.campaign: Campaign
        self.envelope: Envelope
        """The envelope of the flights that finished."""
        self.campaign, self.envelope = read_result(path)

    @property
    def flyable(self) -> bool:
        """True if flights can be flown again: the controller is built in, or the user passed --trust."""
        return self.trust or not names_code(self.campaign.scenario.controller)

    @cached_property
    def sample_runner(self) -> SampleRunner:
        """The sample runner that repeats flights.

        Raises:
            ParameterError: The controller is code that the file names, and the file is not trusted.
        """
        require_trust(self.campaign.scenario.controller, self.path, self.trust)
        return SampleRunner(self.campaign)

    @cached_property
    def disk_margin(self) -> dict[str, Any] | None:
        """The verdict on the disk margin of the design, see :func:`hsv.flight.margins.margin_verdict`."""
        if self.campaign.scenario.disk_margin is None:
            return None
        from hsv.flight.margins import margin_verdict

        return margin_verdict(self.campaign.scenario, design_of(self.campaign.design))

    def column(self, name: str) -> np.ndarray:
        """Return a column of numbers or truth values, shape (flights,), in SI units; undefined numbers are NaN."""
        return values_of(self._table[name])

    def frame(self) -> DataFrame:
        """Return the results as a table with one row per flight.

        Its ``attrs`` have the SI units by column, the limits (SI) by metric, the names of the margins of requirements
        (``required``), and of the campaign the title, the seed, the method and the number of flights at each point of
        the grid (``vehicles``).
        """
        frame = self._table.to_pandas()
        fields, campaign = self._table.schema, self.campaign
        frame.attrs |= {
            "units": {field.name: (field.metadata or {}).get(b"unit", b"").decode() for field in fields},
            "limits": limits(self),
            "required": required(self),
            "title": campaign.scenario.title,
            "vehicles": campaign.vehicles,
            "seed": campaign.seed,
            "method": campaign.method,
        }
        return frame

    @property
    def crashed(self) -> np.ndarray:
        """Whether each flight ended because the controller failed, shape (flights,)."""
        return values_of(self._table["crashed"].is_valid())

    @cached_property
    def finished(self) -> np.ndarray:
        """Whether each flight reached its end, shape (flights,); the others are lost."""
        return ~(self.column("diverged") | self.crashed)

    def not_reached(self, name: str) -> np.ndarray:
        """Whether each flight did not reach the time ``name``, shape (flights,)."""
        names = self._table["not_reached"].to_pylist()
        return np.array([name in each.split() if each else False for each in names])

    @property
    def samples(self) -> np.ndarray:
        """Samples in SI units, shape (flights, factors)."""
        return np.column_stack([self.column(f"sample_{factor.name}") for factor in self.campaign.factors])

    def row(self, flight: int) -> dict[str, Any]:
        """Return the results of one flight by column.

        Raises:
            CampaignError: The campaign has no such flight.
        """
        if not 0 <= flight < self.campaign.samples:
            raise CampaignError(f"flight = {flight}: expected 0 to {self.campaign.samples - 1}")
        [row] = self._table.slice(flight, 1).to_pylist()
        return dict(row)

    def sample(self, flight: int) -> dict[str, float]:
        """Return the recorded sample of a flight (SI) by factor; errors as for :meth:`row`."""
        row = self.row(flight)
        return {factor.name: row[f"sample_{factor.name}"] for factor in self.campaign.factors}

    def file(self, flight: int, **replaced: str) -> str:
        """Return the scenario file of a flight; ``replaced`` overrides top-level keys. Errors as for :meth:`row`."""
        return self.campaign.file(flight, list(self.sample(flight).values()), **replaced)

    @cached_property
    def _table(self) -> pa.Table:
        try:
            with pq.ParquetFile(self.path, page_checksum_verification=True) as file:
                table = file.read()
            if not np.array_equal(values_of(table["flight"]), range(self.campaign.samples)):
                raise ValueError("rows that are not those of the campaign's flights")
        except (OSError, ValueError) as error:
            raise CampaignError(f"{self.path}: damaged, expected the result of a campaign") from error
        return table


def values_of(column: pa.ChunkedArray) -> np.ndarray:
    """Return a column as an array, without importing pandas, as ``to_numpy`` would."""
    values = column.combine_chunks()
    if pa.types.is_boolean(values.type):
        return np.from_dlpack(values.cast(pa.uint8())).view(bool)
    return np.from_dlpack(values.fill_null(_NAN) if values.null_count else values)


def limits(results: Results) -> dict[str, float]:
    """Return the limits (SI) by metric: those of the scenario, and 1 for the tube level if any flight has one."""
    stated = dict(results.campaign.scenario.limits)
    if np.any(np.isfinite(results.column("tube_level"))):
        stated["tube_level"] = TUBE_LIMIT
    return stated


def required(results: Results) -> list[str]:
    """Return the names of the margins of the requirements; a margin is kept if it is at least 0."""
    return [requirement.metric for requirement in results.campaign.scenario.requirement]


def _judged(results: Results) -> dict[str, tuple[float | None, np.ndarray, np.ndarray]]:
    """Return by metric its limit (SI), and of each flight whether it is judged and whether it keeps the limit.

    The masks have shape (flights,). The first entry, ``flown_to_the_end``, has no limit (None) and judges every flight.
    """
    finished = results.finished
    found: dict[str, tuple[float | None, np.ndarray, np.ndarray]] = {}
    found["flown_to_the_end"] = None, np.ones_like(finished), finished
    for name, limit in limits(results).items():
        values = np.abs(results.column(name))
        applies = finished & (~np.isnan(values) | results.not_reached(name))
        found[name] = limit, applies, applies & (values <= limit)  # a comparison with NaN is false
    for name in required(results):
        found[name] = 0.0, finished, finished & (results.column(name) >= 0.0)
    return found


def within_all(results: Results) -> int:
    """Return the number of flights that finish within every limit that applies to them."""
    kept_each = [kept | ~judged for _, judged, kept in _judged(results).values()]
    return int(np.count_nonzero(np.logical_and.reduce(kept_each)))


def shares(results: Results) -> list[Share]:
    """Return the share of the flights that finish, then for each limit the share of those that finish within it."""
    every = results.campaign.method in ("corners", *SEARCHES)
    found = []
    for name, (limit, judged, kept) in _judged(results).items():
        count, n = int(np.count_nonzero(kept)), int(np.count_nonzero(judged))
        found.append(Share(name, limit, count, n, None if every or not n else clopper_pearson(count, n)))
    return found


@dataclass(frozen=True)
class Point:
    """A point of the grid: the ``values`` of its factors (SI) by name, and how many of its flights finish."""

    values: dict[str, float]
    survived: Share
    within_all: int
    """Number of flights that finish within every limit that applies to them"""


def points(results: Results) -> list[Point]:
    """Return the points of a campaign's grid in the order of the flights; empty without a grid."""
    campaign, found = results.campaign, []
    kept = np.logical_and.reduce([kept | ~judged for _, judged, kept in _judged(results).values()])
    for start in range(0, campaign.samples, campaign.vehicles) if campaign.grid else ():
        flights = slice(start, start + campaign.vehicles)
        count, n = int(np.count_nonzero(results.finished[flights])), campaign.vehicles
        interval = None if campaign.method == "corners" else clopper_pearson(count, n)
        values = {factor.name: float(results.column(f"sample_{factor.name}")[start]) for factor in campaign.grid}
        share = Share("flown_to_the_end", None, count, n, interval)
        found.append(Point(values, share, int(np.count_nonzero(kept[flights]))))
    return found


def clopper_pearson(count: int, n: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the exact confidence interval of a probability after ``count`` successes in ``n`` independent trials."""
    from scipy.stats import binomtest

    interval = binomtest(count, n).proportion_ci(confidence, method="exact")
    return float(interval.low), float(interval.high)


def worst_flights(results: Results, number: int = 10, badness: np.ndarray | None = None) -> list[WorstFlight]:
    """Return the ``number`` worst flights: crashed, diverged (earliest first), then by largest ratio to a limit.

    With ``badness`` (flights), that of a search, they are ordered by it instead of by the ratio.
    """
    stated = {name: limit for name, limit in limits(results).items() if limit > 0.0}
    diverged, crashed, end = results.column("diverged"), results.crashed, results.column("end_time")
    every = [*stated, *required(results)]
    ratios = np.zeros((len(diverged), len(every) or 1))
    for index, name in enumerate(every):
        ratio = np.abs(results.column(name)) / stated[name] if name in stated else 1.0 - results.column(name)
        ratios[:, index] = np.where(np.isnan(ratio), np.where(results.not_reached(name), np.inf, 0.0), ratio)
    largest = np.where(diverged | crashed, np.inf, ratios.max(axis=1))
    ended = np.where(crashed, -1.0, np.where(diverged, end, math.inf))
    order = np.lexsort((np.arange(len(end)), ended, -(largest if badness is None else badness)))[:number]
    samples, names = results.samples, every or [""]
    found = []
    for flight in order.tolist():
        within = names[int(np.argmax(ratios[flight]))]
        used = CRASHED if crashed[flight] else DIVERGED if diverged[flight] else within
        sample = zip((factor.name for factor in results.campaign.factors), samples[flight].tolist(), strict=True)
        found.append(WorstFlight(flight, used, float(largest[flight]), dict(sample)))
    return found


@dataclass(frozen=True)
class Distribution:
    """Statistics (SI) of one of the outcomes in the finished flights to which it applies.

    Errors with a sign count by their magnitude. A time that was not reached counts as infinite.
    """

    name: str
    unit: str
    flights: int
    """Number of the flights"""
    not_reached: int
    """Number of those that did not reach the time"""
    minimum: float
    median: float
    percentile_95: float
    maximum: float
    mean: float

    @property
    def title(self) -> str:
        """The name in words, between bars if the statistics are those of the magnitude."""
        return title_of(self.name)


def title_of(name: str) -> str:
    """Return the name of an outcome in words, between bars if its statistics are those of the magnitude."""
    return f"|{spaced(name)}|" if name in METRICS and METRICS[name].signed else spaced(name)


def distributions(results: Results) -> list[Distribution]:
    """Return the statistics of every outcome that applies to at least one finished flight."""
    found = []
    for name, unit in outcomes_of(results.campaign.scenario).items():
        values = sizes(results, name)
        values = values[~np.isnan(values)]
        if len(values):
            numbers = [*percentiles(values, (0.0, 50.0, 95.0, 100.0)), float(values.mean())]
            found.append(Distribution(name, unit, len(values), int(np.isinf(values).sum()), *numbers))
    return found


def sizes(results: Results, name: str) -> np.ndarray:
    """Return an outcome of all flights, shape (flights,), errors with a sign by their magnitude.

    A time that was not reached is infinite; NaN if the flight is lost or the outcome does not apply.
    """
    values = results.column(name)
    values = np.abs(values) if name in METRICS and METRICS[name].signed else values
    return np.where(results.finished, np.where(results.not_reached(name), np.inf, values), np.nan)


def percentiles(values: np.ndarray, shares: Sequence[float]) -> list[float]:
    """Return the percentiles of ``values``, shape (n,), some of which may be infinite, but none NaN."""
    found = np.percentile(np.nan_to_num(values, posinf=_NEVER, neginf=-_NEVER), shares)
    return [math.copysign(math.inf, number) if abs(number) > _LATE else number for number in found.tolist()]

"""The table of a campaign's results: one row a flight, units in the columns' metadata."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from io import BytesIO
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hsv.campaign.campaign import Campaign
from hsv.campaign.envelope import Envelope
from hsv.campaign.executors import Job
from hsv.campaign.sample_runner import SampleRunner, sample_runner
from hsv.control.library import LibraryController
from hsv.errors import ControllerError
from hsv.simulation.closed_loop import watched
from hsv.simulation.metrics import METRICS

CAMPAIGN, ENVELOPE, DIGEST = b"hsv.campaign", b"hsv.envelope", b"hsv.digest"
"""Keys of the file's metadata."""

OUTCOMES = {"end_time": "s", "tube_level": "1", **{name: metric.unit for name, metric in METRICS.items()}}
"""Numbers that are kept of a flight, with their SI units; null where a flight does not define one."""

WRITTEN: dict[str, Any] = {"compression": "zstd", "write_page_checksum": True}
"""Options for writing results: with checksums, which detect damage that can be decompressed without an error."""

_BATCH_WRITTEN: dict[str, Any] = {
    "compression": "none",
    "use_dictionary": False,
    "write_statistics": False,
    "write_page_checksum": True,
}
"""The same of a batch, which is soon read once and removed: to make it small takes longer than to write it."""

_SLOW = 2.0
"""Seconds from which on a flight is flown whole once at most to see how long it takes, not sample by sample."""

_VERY_SLOW = 60.0
"""Seconds from which on it is not, and a piece of it has to do."""

_PIECE = 198
"""Steps of that piece. Problems that are solved every 2 s, and in the first step, count as often as in the rest; of
those that are solved in every step the first ones take longest: what is extrapolated is rather too much.
"""


def schema(campaign: Campaign) -> pa.Schema:
    """Return the columns: flight, seed, the sample, what became of it, its fingerprint."""
    samples = [_number(f"sample_{factor.name}", factor.unit) for factor in campaign.factors]
    outcomes = [_number(name, unit) for name, unit in OUTCOMES.items()]
    fixed = [pa.field("flight", pa.int64(), False), pa.field("seed", pa.uint64(), False)]
    ended = [pa.field("diverged", pa.bool_(), False), pa.field("crashed", pa.string())]
    return pa.schema([*fixed, *samples, *ended, *outcomes, pa.field("fingerprint", pa.string())])


def _number(name: str, unit: str) -> pa.Field:
    return pa.field(name, pa.float64(), metadata={"unit": unit})


def fly_batch(text: str, batch: int) -> bytes:
    """Fly a batch of the campaign written in ``text``; return its rows and envelope as a Parquet file.

    Raises:
        ScenarioError: The scenario does not admit the values of a flight together; it is named.
    """
    return _fly(_flown_here, text, batch)


def time_flight(text: str, flight: int) -> bytes:
    """Return how long (s) a flight of the campaign in ``text`` takes, as a text: flown, or a piece of a slow one.

    Raises:
        ScenarioError: The scenario does not admit the values of the flight together; it is named.
    """
    return _fly(_timed_here, text, flight)


def _fly(job: Job, text: str, number: int) -> bytes:
    runner = sample_runner(text)
    if isinstance(runner.controller, LibraryController):
        # All of it in the library's process, and flights one by one only where one makes it crash.
        with suppress(ControllerError), watched(runner.controller, runner.steps + 1) as (_, request):
            return bytes(request("call", job, text, number))
    return job(text, number)


def _flown_here(text: str, batch: int) -> bytes:
    runner = sample_runner(text)
    return encode(runner.campaign, *_rows(runner, runner.campaign.flights(batch)))


def _timed_here(text: str, flight: int) -> bytes:
    expected = _flight_time(text)
    if expected < _SLOW:
        runner = sample_runner(text)
        # As many as are flown at once: one of them alone would take longer.
        flights = range(flight, min(flight + runner.at_once, runner.campaign.samples))
        started = time.perf_counter()
        _rows(runner, flights)
        expected = (time.perf_counter() - started) / len(flights)
    return repr(expected).encode()


@lru_cache(maxsize=1)
def _flight_time(text: str) -> float:
    """Return how long (s) the scenario's flight takes, extrapolated from a piece of it where that is long.

    What is compiled and built once is there then.
    """
    runner = sample_runner(text)
    seconds = 0.0
    with suppress(ControllerError):  # the flights are going to say so
        runner.fly_piece(1)
        for steps in (min(_PIECE, runner.steps), runner.steps):
            started = time.perf_counter()
            flown = runner.fly_piece(steps)
            seconds = (time.perf_counter() - started) * (runner.steps / steps if flown == steps else 1.0)
            if not _SLOW < seconds < _VERY_SLOW:
                break
    return seconds


def _rows(runner: SampleRunner, flights: range) -> tuple[list[dict[str, Any]], Envelope]:
    campaign, envelope, rows = runner.campaign, Envelope.empty(), []
    samples, seeds = runner.sampler.draw(flights)
    drawn = zip(flights, samples, seeds, runner.fly_all(flights, samples), strict=True)
    for flight, sample, seed, flown in drawn:
        if isinstance(flown, ControllerError):
            outcome = runner.crashed(flown)
        else:
            data = flown.flight.data()
            envelope.add(data, runner.steps)
            outcome = runner.outcome(data, flown.level, flown.fingerprint)
        rows.append(row(sample, flight, int(seed), campaign, outcome))
    return rows, envelope


def row(sample: Sequence[float], flight: int, seed: int, campaign: Campaign, outcome: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a flight."""
    samples = {f"sample_{f.name}": float(value) for f, value in zip(campaign.factors, sample, strict=True)}
    return {"flight": flight, "seed": seed, **samples, **outcome}


def encode(campaign: Campaign, rows: list[dict[str, Any]], envelope: Envelope) -> bytes:
    """Return rows and envelope as a Parquet file."""
    table = pa.Table.from_pylist(rows, schema=schema(campaign).with_metadata({ENVELOPE: envelope.encode()}))
    stream = BytesIO()
    pq.write_table(table, stream, **_BATCH_WRITTEN)
    return stream.getvalue()

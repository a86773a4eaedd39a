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

from hsv.base.errors import ControllerError
from hsv.control.library import LibraryController
from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.executors import Job
from hsv.flight.campaign.flight_reader import FlightReading
from hsv.flight.campaign.sample_runner import Outcome, SampleRunner, sample_runner
from hsv.flight.closed_loop import watched
from hsv.flight.metrics import METRICS

CAMPAIGN, ENVELOPE, DIGEST = b"hsv.campaign", b"hsv.envelope", b"hsv.digest"
"""Keys of the file's metadata."""

_SECONDS = b"hsv.seconds"
"""The same of a batch, for the time that its flights took."""

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
"""Seconds from which on a flight is flown whole to see how long it takes: a piece is enough of a fast one."""

_VERY_SLOW = 60.0
"""Seconds from which on it is not, and a piece has to do."""

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


def seconds_of(content: bytes) -> float:
    """Return how long (s) the flights of a batch took that :func:`fly_batch` returned."""
    return float(pq.read_schema(BytesIO(content)).metadata[_SECONDS])


def time_flight(text: str, core: int) -> bytes:
    """Return about how long (s) a flight takes a ``core`` that flies as many as it does at once, as a text.

    What its flights share is built then, and what is compiled is there.
    """
    return _fly(_timed_here, text, core)


def _fly(job: Job, text: str, number: int) -> bytes:
    runner = sample_runner(text)
    if isinstance(runner.controller, LibraryController):
        # All of it in the library's process, and flights one by one only where one makes it crash.
        with suppress(ControllerError), watched(runner.controller, runner.steps + 1) as (_, request):
            return bytes(request("call", job, text, number))
    return job(text, number)


def _flown_here(text: str, batch: int) -> bytes:
    runner = sample_runner(text)
    started = time.perf_counter()
    rows, envelope = _rows(runner, runner.campaign.flights(batch))
    return encode(runner.campaign, rows, envelope, time.perf_counter() - started)


def _timed_here(text: str, core: int) -> bytes:
    return repr(_flight_time(text)).encode()


@lru_cache(maxsize=1)
def _flight_time(text: str) -> float:
    """Return how long (s) the scenario's flight takes, extrapolated from a piece of it where that is long, or short."""
    runner = sample_runner(text)
    seconds = 0.0
    with suppress(ControllerError):  # the flights are going to say so
        for flown in runner.fly_piece(1):
            _outcome(runner, flown, Envelope.empty())
        for steps in (min(_PIECE, runner.steps), runner.steps):
            started = time.perf_counter()
            pieces = runner.fly_piece(steps)
            seconds = (time.perf_counter() - started) / len(pieces)
            if all(len(piece.curves.time) > steps for piece in pieces):
                seconds *= runner.steps / steps
            if not _SLOW < seconds < _VERY_SLOW:
                break
    return seconds


def _rows(runner: SampleRunner, flights: range) -> tuple[list[dict[str, Any]], Envelope]:
    campaign, envelope, rows = runner.campaign, Envelope.empty(), []
    samples, seeds = runner.sampler.draw(flights)
    for flight, sample, seed, flown in zip(flights, samples, seeds, runner.fly_all(flights, samples), strict=True):
        outcome = runner.crashed(flown) if isinstance(flown, ControllerError) else _outcome(runner, flown, envelope)
        rows.append(row(sample, flight, int(seed), campaign, outcome))
    return rows, envelope


def _outcome(runner: SampleRunner, flown: FlightReading, envelope: Envelope) -> Outcome:
    envelope.add(flown.curves, runner.steps)
    return runner.outcome(flown)


def row(sample: Sequence[float], flight: int, seed: int, campaign: Campaign, outcome: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a flight."""
    samples = {f"sample_{f.name}": float(value) for f, value in zip(campaign.factors, sample, strict=True)}
    return {"flight": flight, "seed": seed, **samples, **outcome}


def encode(campaign: Campaign, rows: list[dict[str, Any]], envelope: Envelope, seconds: float) -> bytes:
    """Return rows and envelope as a Parquet file, with the ``seconds`` that the flights took."""
    beside = {ENVELOPE: envelope.encode(), _SECONDS: repr(seconds)}
    table = pa.Table.from_pylist(rows, schema=schema(campaign).with_metadata(beside))
    stream = BytesIO()
    pq.write_table(table, stream, **_BATCH_WRITTEN)
    return stream.getvalue()

"""Running a campaign to its end, from the batches that are finished already."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from hsv.campaign.campaign import Campaign
from hsv.campaign.envelope import Envelope
from hsv.campaign.executors import Executor
from hsv.campaign.sample_runner import sample_runner
from hsv.campaign.store import ResultStore
from hsv.campaign.table import fly_batch, schema
from hsv.errors import ControllerError


@dataclass(frozen=True)
class Capacity:
    """The flights that are still to be flown, and their cost: wall time (s) on ``cores``, and bytes on the disk."""

    flights: int
    cores: int
    wall_time: float
    bytes: int


def run_campaign(
    campaign: Campaign,
    store: ResultStore,
    executor: Executor,
    *,
    restart: bool = False,
    expect: Callable[[Capacity], None] = lambda capacity: None,
    progress: Callable[[int], None] = lambda flights: None,
) -> int:
    """Fly the missing flights of ``campaign`` and write its result file; return how many were flown.

    Args:
        campaign: The campaign.
        store: Where results are kept; batches that are there already are not flown again.
        executor: The back end that flies the batches.
        restart: Whether to discard existing results first.
        expect: Called once, before the first flight, with the capacity that the run needs.
        progress: Called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError, RunError: See :class:`hsv.campaign.store.ResultStore` and :mod:`hsv.campaign.executors`.
    """
    flown = 0
    with store.opened(restart) as finished:
        if store.out.exists():
            return 0
        missing = [batch for batch in range(campaign.batches) if batch not in finished]
        done = sum(len(campaign.flights(batch)) for batch in finished)
        if missing:
            expect(capacity(campaign, campaign.samples - done, executor.cores))
        progress(done)
        for batch, content in executor.fly(fly_batch, campaign.text, missing):
            store.keep(batch, content)
            flown += len(campaign.flights(batch))
            progress(done + flown)
        store.finish()
    return flown


def capacity(campaign: Campaign, flights: int, cores: int) -> Capacity:
    """Return the cost of ``flights`` on so many cores as fast as this one, measured by flying the scenario."""
    runner = sample_runner(campaign.text)
    with suppress(ControllerError):
        flown = runner.fly_unchanged()
        runner.outcome(flown.data(), flown.fingerprint)
    started = time.perf_counter()
    with suppress(ControllerError):
        flown = runner.fly(0, runner.sample(0))
        runner.outcome(flown.data(), flown.fingerprint)
    seconds = time.perf_counter() - started
    # Eight bytes a number, hardly less when compressed; beside the rows, each batch keeps its envelope for a while.
    rows = flights * 8 * len(schema(campaign))
    envelopes = campaign.batches * len(Envelope.empty().encode())
    return Capacity(flights, cores, flights * seconds / max(cores, 1), rows + envelopes)

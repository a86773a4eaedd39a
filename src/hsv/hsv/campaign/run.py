"""Running a campaign to its end, from the batches that are finished already."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hsv.campaign.campaign import Campaign
from hsv.campaign.capacity import Capacity, evenly, timed
from hsv.campaign.envelope import Envelope
from hsv.campaign.executors import Executor
from hsv.campaign.store import ResultStore
from hsv.campaign.table import fly_batch, schema, time_flight

_TIMED = 4
"""Flights a core that are timed before the start."""


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
        expect: Called once, after flights that are timed, with the capacity that the run needs.
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
            expect(capacity(campaign, missing, executor))
        progress(done)
        for batch, content in executor.fly(fly_batch, campaign.text, missing):
            store.keep(batch, content)
            flown += len(campaign.flights(batch))
            progress(done + flown)
        store.finish()
    return flown


def capacity(campaign: Campaign, missing: Sequence[int], executor: Executor) -> Capacity:
    """Return what flying the ``missing`` batches takes."""
    cores = max(executor.cores, 1)
    flights = [flight for batch in missing for flight in campaign.flights(batch)]
    seconds = timed(executor, time_flight, campaign.text, evenly(flights, _TIMED * cores))
    # Whole batches go to the cores in turn.
    longest = min(-(-len(missing) // cores) * campaign.batch, len(flights))
    # Eight bytes a number, hardly less when compressed; beside the rows, each batch keeps its envelope for a while.
    rows = len(flights) * 8 * len(schema(campaign))
    envelopes = campaign.batches * len(Envelope.empty().encode())
    return Capacity(len(flights), cores, longest * sum(seconds.values()) / len(seconds), rows + envelopes)

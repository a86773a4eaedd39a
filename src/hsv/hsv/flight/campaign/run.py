"""Running a campaign to its end, from the batches that are finished already."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hsv.flight.campaign.campaign import Campaign
from hsv.flight.campaign.capacity import Capacity, evenly
from hsv.flight.campaign.envelope import Envelope
from hsv.flight.campaign.executors import Executor
from hsv.flight.campaign.store import ResultStore
from hsv.flight.campaign.table import fly_batch, schema, seconds_of, time_flight

_LATE = 30.0
"""Seconds: where a batch takes longer, the announcement does not wait for the first batches."""


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
        expect: Called once with the capacity that the run needs, as its first batches tell, one a core from all over
            it; before them where they take long.
        progress: Called with the number of finished flights, those found at the start included; first when workers
            have built what their flights share.

    Raises:
        CampaignError, RunError: See :class:`hsv.flight.campaign.store.ResultStore` and
            :mod:`hsv.flight.campaign.executors`.
    """
    flown = 0
    with store.opened(restart) as finished:
        if store.out.exists():
            return 0
        missing = [batch for batch in range(campaign.batches) if batch not in finished]
        done = sum(len(campaign.flights(batch)) for batch in finished)
        cores = max(executor.cores, 1)
        first = evenly(missing, cores)
        if missing:
            alone = [float(content) for _, content in executor.fly(time_flight, campaign.text, range(cores))]
            if max(alone) * campaign.batch > _LATE:
                expect(capacity(campaign, missing, cores, sum(alone) / len(alone)))
                first = []
        progress(done)
        order, seconds, size = [*first, *(batch for batch in missing if batch not in first)], 0.0, 0
        for count, (batch, content) in enumerate(executor.fly(fly_batch, campaign.text, order), 1):
            store.keep(batch, content)
            flown += len(campaign.flights(batch))
            if count <= len(first):
                seconds += seconds_of(content)
                size += len(content)
            if count == len(first):
                expect(capacity(campaign, missing, cores, seconds / flown, size / count))
            progress(done + flown)
        store.finish()
    return flown


def capacity(
    campaign: Campaign, missing: Sequence[int], cores: int, seconds: float, size: float | None = None
) -> Capacity:
    """Return what flying the ``missing`` batches on so many ``cores`` takes.

    Args:
        campaign: The campaign.
        missing: Numbers of the batches to be flown.
        cores: Number of flights that are flown at the same time.
        seconds: What a flight takes one of the cores, s.
        size: Bytes of a batch; None: estimated.
    """
    flights = sum(len(campaign.flights(batch)) for batch in missing)
    # Whole batches go to the cores in turn.
    longest = min(-(-len(missing) // cores) * campaign.batch, flights)
    # Eight bytes a number, hardly less when compressed.
    row, envelope = 8 * len(schema(campaign)), len(Envelope.empty().encode())
    if size is None:
        # A batch has its envelope twice, the second time in the schema, in base 64.
        size = campaign.batch * row + envelope * (1.0 + 4.0 / 3.0)
    # The batches are kept until the result is whole.
    result = campaign.samples * row + envelope
    return Capacity(flights, cores, longest * seconds, round(len(missing) * size) + result)

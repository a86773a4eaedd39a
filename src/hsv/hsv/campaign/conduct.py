"""Flying a campaign to its end, from wherever it was left."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from hsv.campaign.campaign import Campaign
from hsv.campaign.envelope import Envelope
from hsv.campaign.fleet import Fleet
from hsv.campaign.pilot import pilot
from hsv.campaign.store import Store
from hsv.campaign.table import schema
from hsv.errors import ControllerError


@dataclass(frozen=True)
class Capacity:
    """What is still to be flown, and what it takes: wall time (s) on ``cores``, and bytes on the disk."""

    flights: int
    cores: int
    wall_time: float
    bytes: int


def conduct(
    campaign: Campaign,
    store: Store,
    fleet: Fleet,
    *,
    restart: bool = False,
    expect: Callable[[Capacity], None] = lambda capacity: None,
    progress: Callable[[int], None] = lambda flights: None,
) -> int:
    """Fly what is missing of ``campaign`` and make its result file; return how many flights were flown.

    Args:
        campaign: What to fly.
        store: Where results are kept; batches that are there already are not flown again.
        fleet: Who flies.
        restart: Begin anew.
        expect: Called once, before the first flight, with what is to come.
        progress: Called with the number of finished flights, those found at the start included.

    Raises:
        CampaignError, RunError: See :class:`hsv.campaign.store.Store` and :mod:`hsv.campaign.fleet`.
    """
    flown = 0
    with store.opened(restart) as finished:
        if store.out.exists():
            return 0
        missing = [batch for batch in range(campaign.batches) if batch not in finished]
        done = sum(len(campaign.flights(batch)) for batch in finished)
        if missing:
            expect(capacity(campaign, campaign.samples - done, fleet.cores))
        progress(done)
        for batch, content in fleet.fly(campaign.text, missing):
            store.keep(batch, content)
            flown += len(campaign.flights(batch))
            progress(done + flown)
        store.finish()
    return flown


def capacity(campaign: Campaign, flights: int, cores: int) -> Capacity:
    """Return what ``flights`` take on so many cores as fast as this one, measured on the scenario itself."""
    own = pilot(campaign.text)
    with suppress(ControllerError):
        flown = own.fly_unchanged()
        own.outcome(flown.data(), flown.fingerprint)
    started = time.perf_counter()
    with suppress(ControllerError):
        flown = own.fly(own.sample(0))
        own.outcome(flown.data(), flown.fingerprint)
    seconds = time.perf_counter() - started
    # Eight bytes a number, hardly less when compressed; beside the rows, each batch keeps its envelope for a while.
    rows = flights * 8 * len(schema(campaign))
    envelopes = campaign.batches * len(Envelope.empty().encode())
    return Capacity(flights, cores, flights * seconds / max(cores, 1), rows + envelopes)

"""Who flies: this process, or the workers of a Dask cluster, on this machine or on many."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any, Protocol

from hsv.campaign.table import fly_batch
from hsv.errors import CampaignError, RunError

_AHEAD = 4
"""Batches a core that wait at the workers: enough that none is idle, few enough that a lost worker loses little."""

_LOCAL = {
    # Without Dask's MALLOC_TRIM_THRESHOLD_, with which every flight's arrays are given back and faulted in again.
    "distributed.nanny.pre-spawn-environ": {f"{name}_NUM_THREADS": 1 for name in ("OMP", "MKL", "OPENBLAS")},
    # What only a dashboard shows, and the watch over memory that flights do not pile up.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    **{f"distributed.worker.memory.{limit}": False for limit in ("target", "spill", "pause", "terminate")},
}
"""Settings of workers on this machine; together they give a sixth more flights a second."""


class Fleet(Protocol):
    """Flies batches."""

    @property
    def cores(self) -> int:
        """Number of flights at a time."""

    def fly(self, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch of the campaign written in ``text``, in any order."""


class OwnProcess:
    """Flies here, one flight after the other."""

    cores = 1

    def fly(self, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch."""
        for batch in batches:
            yield batch, fly_batch(text, batch)


class DaskWorkers:
    """Flies on the workers of a Dask scheduler; what a lost worker had in hand is flown by another."""

    def __init__(self, client: Any) -> None:
        self._client = client

    @property
    def cores(self) -> int:
        """Threads of all workers."""
        return sum(self._client.nthreads().values())

    def fly(self, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch.

        Raises:
            RunError: Workers die of a batch again and again.
        """
        from distributed import KilledWorker, as_completed

        waiting = iter(batches)
        # The campaign travels once to each worker; made by a task, it survives the worker that holds it.
        campaign = self._client.submit(str, text)
        running = as_completed(loop=self._client.loop, with_results=True)
        numbers = {}

        def submit(count: int) -> None:
            for batch in islice(waiting, count):
                future = self._client.submit(fly_batch, campaign, batch)
                numbers[future.key] = batch
                running.add(future)

        submit(_AHEAD * max(self.cores, 1))
        try:
            for future, content in running:
                submit(1)
                yield numbers.pop(future.key), content
        except KilledWorker as error:
            raise RunError(
                f"campaign: several workers died of the same batch ({error}); what is finished is kept"
            ) from error


@contextmanager
def fleet(workers: int, scheduler: str = "") -> Iterator[Fleet]:
    """Yield who flies: the workers of the ``scheduler`` at this address, or so many processes of this machine.

    Args:
        workers: 1 flies in this process.
        scheduler: Address of a Dask scheduler, e.g. ``"tcp://10.0.0.1:8786"``; empty: this machine.

    Raises:
        CampaignError: No scheduler answers there, or the number is not admissible.
    """
    if not 1 <= workers <= 4096:
        raise CampaignError(f"workers = {workers}: expected 1 to 4096")
    if workers == 1 and not scheduler:
        yield OwnProcess()
        return
    import dask
    from distributed import Client, LocalCluster

    if scheduler:
        try:
            client = Client(scheduler, timeout="20s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise CampaignError(f"scheduler = {scheduler!r}: no answer, expected a running Dask scheduler") from error
        with client:
            client.wait_for_workers(1)
            yield DaskWorkers(client)
        return
    with (
        dask.config.set(_LOCAL),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            preload=["hsv.campaign.worker"],
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        yield DaskWorkers(client)

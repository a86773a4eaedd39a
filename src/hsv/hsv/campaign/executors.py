"""Execution back ends of campaigns: this process, or the workers of a Dask cluster on one machine or on many."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import islice
from typing import Any, Protocol

from hsv.campaign.program import check_workers
from hsv.campaign.scheduler import connected
from hsv.errors import CampaignError, RunError, reason
from hsv.threads import ctrl_c_held_back

_AHEAD = 4
"""Batches per core that are queued at the workers: enough that none is idle, few enough that a lost worker costs
little."""

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


Job = Callable[[str, int], bytes]
"""Flies a batch, by its number, of the campaign written in a text, and returns what is to be kept of it."""


class Executor(Protocol):
    """An execution back end, which flies the batches of a campaign."""

    @property
    def cores(self) -> int:
        """Number of flights that are flown at the same time."""

    def fly(self, job: Job, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch of the campaign in ``text``, as ``job`` flies it, in any order."""


_KEPT = "what is finished is kept"


class SerialExecutor:
    """Flies the batches in this process, one flight after the other."""

    cores = 1

    def fly(self, job: Job, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch."""
        for batch in batches:
            yield batch, job(text, batch)


class DaskExecutor:
    """Flies the batches on the workers of a Dask scheduler; batches of a lost worker are flown by another."""

    def __init__(self, client: Any) -> None:
        self._client = client

    @property
    def cores(self) -> int:
        """Threads of all workers."""
        return sum(self._client.nthreads().values())

    def fly(self, job: Job, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch.

        Raises:
            RunError: Workers die of a batch again and again, or the scheduler is lost.
        """
        from distributed import KilledWorker, as_completed

        waiting = iter(batches)
        # The campaign travels once to each worker; made by a task, it survives the worker that holds it.
        campaign = self._client.submit(str, text)
        running = as_completed(loop=self._client.loop, with_results=True)
        numbers = {}

        def submit(count: int) -> None:
            for batch in islice(waiting, count):
                future = self._client.submit(job, campaign, batch)
                numbers[future.key] = batch
                running.add(future)

        submit(_AHEAD * max(self.cores, 1))
        try:
            for future, content in running:
                if not isinstance(content, bytes):
                    raise RunError(f"campaign: the scheduler is lost ({future.status}); {_KEPT}")
                submit(1)
                yield numbers.pop(future.key), content
        except KilledWorker as error:
            raise RunError(f"campaign: several workers died of the same batch ({error}); {_KEPT}") from error
        except ImportError as error:
            raise RunError(f"campaign: a worker that came later has another program ({error}); {_KEPT}") from error
        except OSError as error:
            raise RunError(f"campaign: the scheduler is lost ({reason(error)}); {_KEPT}") from error


@contextmanager
def make_executor(workers: int, scheduler: str = "", on_wait: Callable[[], None] = lambda: None) -> Iterator[Executor]:
    """Yield the executor for the ``scheduler`` at an address, or for a number of processes of this machine.

    Args:
        workers: Number of processes; 0: one per processor; 1 flies in this process.
        scheduler: Address of a Dask scheduler, e.g. ``"tcp://10.0.0.1:8786"``; empty: this machine.
        on_wait: Called if the scheduler has no workers yet, before they are waited for.

    Raises:
        CampaignError: The number or the address is not admissible, no scheduler answers there, it has no workers, or
            one of them has another program.
    """
    if not 0 <= workers <= 4096:
        raise CampaignError(f"workers = {workers}: expected 0 to 4096")
    if scheduler:
        if workers:
            raise CampaignError(f"workers = {workers}: expected no --workers with --scheduler, whose workers fly")
        with connected(scheduler, on_wait) as client:
            check_workers(client, scheduler)
            yield DaskExecutor(client)
        return
    workers = workers or os.cpu_count() or 1
    if workers == 1:
        yield SerialExecutor()
        return
    import dask
    from distributed import Client, LocalCluster

    with dask.config.set(_LOCAL), ExitStack() as stack:
        with ctrl_c_held_back():
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    # Without it every scheduler asks for the same port, and a second campaign would be told so.
                    scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},
                    silence_logs=logging.CRITICAL,
                )
            )
            client = stack.enter_context(Client(cluster, set_as_default=False))
        yield DaskExecutor(client)

"""Execution back ends of campaigns: this process, others of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any, Protocol

from hsv.campaign.program import check_workers
from hsv.campaign.scheduler import connected
from hsv.errors import CampaignError, RunError, reason
from hsv.interruption import end_with_parent
from hsv.threads import ctrl_c_held_back

_AHEAD = 4
"""Batches per core that are queued at the workers: enough that none is idle, few enough that a lost worker costs
little."""

_AHEAD_HERE = 2
"""The same of processes of this machine: one that flies, and one that waits."""

_TRIES = 4
"""Workers that die of the same batch, or with it in their queue, before the campaign ends."""

_ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS")}
"""Environment of a worker: one thread each, as there are as many workers as processors."""


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


class ProcessExecutor:
    """Flies the batches in processes of this machine, each with a queue of its own; one that is lost is replaced."""

    def __init__(self, workers: int) -> None:
        """Make an executor of so many processes, which :meth:`start` starts and :meth:`close` ends."""
        self.cores = workers
        self._workers: list[_Worker] = []

    def start(self) -> None:
        """Start the processes; Ctrl-C takes effect when all have started.

        Raises:
            RunError: One of them does not start.
        """
        with ctrl_c_held_back():
            for _ in range(self.cores):
                self._workers.append(_Worker())
            try:
                self.pids()
            except BrokenProcessPool as error:
                raise RunError(f"campaign: a worker process does not start ({error})") from error

    def pids(self) -> list[int]:
        """Return the process identifiers of the workers, once they have started."""
        return [worker.pid.result() for worker in self._workers]

    def fly(self, job: Job, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch.

        Raises:
            RunError: Workers die of a batch again and again.
        """
        waiting, lost = iter(batches), Counter[int]()
        running: dict[Future[bytes], tuple[int, int]] = {}

        def submit(place: int, some: Iterable[int]) -> None:
            for batch in some:
                running[self._workers[place].submit(job, text, batch)] = place, batch

        for place in [*range(self.cores)] * _AHEAD_HERE:
            submit(place, islice(waiting, 1))
        while running:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                place, batch = running.pop(future)
                if not isinstance(future.exception(), BrokenProcessPool):
                    submit(place, islice(waiting, 1))
                    yield batch, future.result()
                    continue
                lost[batch] += 1
                if lost[batch] >= _TRIES:
                    raise RunError(f"campaign: several workers died of the same batch; {_KEPT}")
                submit(place, [batch])

    def kill(self) -> None:
        """End the processes at once: what they fly may take minutes."""
        for worker in self._workers:
            with suppress(BrokenProcessPool, ProcessLookupError):
                os.kill(worker.pid.result(), signal.SIGKILL)

    def close(self) -> None:
        """Wait until the processes have ended."""
        for worker in self._workers:
            worker.close()


class _Worker:
    """A process that does one thing after the other, and never receives Ctrl-C; lost, it is started again."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, context, end_with_parent, (os.getpid(),))
        before = {name: os.environ.get(name) for name in _ONE_THREAD}
        with ctrl_c_held_back():
            os.environ.update(_ONE_THREAD)
            try:
                self.pid = self._pool.submit(os.getpid)  # the process starts with its first job
            finally:
                for name, value in before.items():
                    if value is None:
                        del os.environ[name]
                    else:
                        os.environ[name] = value

    def submit(self, job: Callable[..., Any], *arguments: Any) -> Future[Any]:
        try:
            return self._pool.submit(job, *arguments)
        except BrokenProcessPool:
            self.close()
            self._start()
            return self._pool.submit(job, *arguments)

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)


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
    flying = ProcessExecutor(workers)
    try:
        flying.start()
        yield flying
    except BaseException:
        flying.kill()
        raise
    finally:
        flying.close()

"""Execution back ends of campaigns: this process, others of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import pickle
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol, cast

from hsv.base.errors import CampaignError, RunError, reason
from hsv.base.processes import ctrl_c_held_back, end_with_parent
from hsv.flight.campaign.program import check_workers
from hsv.flight.campaign.scheduler import connected

_AHEAD = 4
"""Batches per core that are queued at the workers: enough that none is idle, few enough that a lost worker costs
little."""

_AHEAD_HERE = 2
"""The same for the processes of this machine: one batch flying, one waiting."""

_TRIES = 4
"""Workers lost with the same batch before the campaign ends."""

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
        """Make an executor with this many processes; :meth:`start` starts them, :meth:`close` waits for their end."""
        self.cores = workers
        self._workers: list[_Worker] = []

    def start(self) -> None:
        """Start the processes.

        Raises:
            RunError: One of them cannot be started.
        """
        for _ in range(self.cores):
            self._workers.append(_Worker())

    def pids(self) -> list[int | None]:
        """Return the process identifiers of the workers."""
        return [worker.process.pid for worker in self._workers]

    def fly(self, job: Job, text: str, batches: Iterable[int]) -> Iterator[tuple[int, bytes]]:
        """Yield number and content of each batch.

        Raises:
            RunError: The same batch was lost with several workers.
        """
        waiting, lost = iter(batches), Counter[int]()
        for worker in self._workers:
            worker.begin(job, text)
        for worker in self._workers * _AHEAD_HERE:
            worker.give(islice(waiting, 1))
        while busy := {worker.connection: worker for worker in self._workers if worker.queue}:
            for connection in wait([*busy]):
                worker = busy[cast(Connection, connection)]
                try:
                    answer = worker.connection.recv()
                except (EOFError, OSError):
                    again = [*worker.queue]
                    lost[again[0]] += 1
                    code = worker.restart()
                    if lost[again[0]] >= _TRIES:
                        died = f"several workers died of the same batch, at last with exit code {code}"
                        raise RunError(f"campaign: {died}; {_KEPT}") from None
                    worker.begin(job, text)
                    worker.give(again)
                    continue
                batch = worker.queue.popleft()
                worker.give(islice(waiting, 1))
                if isinstance(answer, Exception):
                    raise answer
                yield batch, answer

    def kill(self) -> None:
        """End the processes at once: what they fly may take minutes."""
        for worker in self._workers:
            worker.process.kill()

    def close(self) -> None:
        """Wait until the processes have ended."""
        for worker in self._workers:
            worker.connection.close()
        for worker in self._workers:
            worker.process.join()


class _Worker:
    """A process that flies one batch after another and never receives Ctrl-C."""

    def __init__(self) -> None:
        self.queue: deque[int] = deque()
        """Batches that it has been given, and has not answered."""
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        before = {name: os.environ.get(name) for name in _ONE_THREAD}
        with ctrl_c_held_back():
            os.environ.update(_ONE_THREAD)
            try:
                self.connection, its_end = context.Pipe()
                # Closed here: the connection then ends with the process, also in the middle of an answer.
                with its_end:
                    self.process = context.Process(target=_serve, args=(its_end, os.getpid()))
                    self.process.start()
            except OSError as error:
                raise RunError(f"campaign: a worker process cannot be started ({reason(error)})") from error
            finally:
                for name, value in before.items():
                    if value is None:
                        del os.environ[name]
                    else:
                        os.environ[name] = value

    def begin(self, job: Job, text: str) -> None:
        """Say what is to be flown. Batches of an earlier flying that ended early are given up, with the process."""
        if self.queue:
            self.restart()
        with suppress(OSError):  # it has ended, as is noticed when it should answer
            self.connection.send((job, text))

    def give(self, batches: Iterable[int]) -> None:
        """Let it fly ``batches``, after those that it has."""
        for batch in batches:
            self.queue.append(batch)
            with suppress(OSError):
                self.connection.send(batch)

    def restart(self) -> int | None:
        """End the process, if it has not ended, and start another, without batches; return the exit code."""
        self.process.join(0.1)  # one that is just ending has an exit code of its own
        self.process.kill()
        self.process.join()
        code = self.process.exitcode
        self.connection.close()
        self.queue.clear()
        self._start()
        return code


def _serve(connection: Connection, parent: int) -> None:
    """Fly what the ``parent`` asks for, until it closes the connection."""
    end_with_parent(parent)
    with suppress(EOFError, OSError):
        while True:
            asked = connection.recv()
            if isinstance(asked, tuple):
                job, text = asked
                continue
            try:
                answer = job(text, asked)
            except Exception as error:
                answer = _portable(error)
            connection.send(answer)


def _portable(error: Exception) -> Exception:
    """Return an error that arrives in another process: not all can be made again of their arguments."""
    try:
        return cast(Exception, pickle.loads(pickle.dumps(error)))
    except Exception:
        return RunError(f"{type(error).__name__}: {error}")


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

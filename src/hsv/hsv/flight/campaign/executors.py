"""Executors of campaigns: this process, processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

import logging
import multiprocessing
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from concurrent.futures import Executor as Pool
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from hashlib import sha256
from importlib.metadata import version
from itertools import islice
from multiprocessing.process import BaseProcess
from numbers import Integral
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hsv.base.errors import CampaignError, RunError, reason, require
from hsv.base.processes import ctrl_c_held_back, end_with_parent
from hsv.flight.fingerprint import DIGITS, code_digest

Job = Callable[[str, int], bytes]
"""A function (text of a campaign, batch number) that flies the batch and returns its result."""

Notice = Callable[[str], None]
"""A function that shows the user a message about what the campaign waits for."""

QUIET_TIME = 10.0
"""Seconds without a result after which the user is told what the campaign waits for."""

ANSWER, WORKERS = 60.0, 300.0
"""Seconds to wait for a Dask scheduler, and for the first of its workers: a cluster may have to start machines."""

_AHEAD = 2
"""Number of submitted batches per core: one is being flown, and one waits."""

_LOOK = 0.5
"""Seconds between two checks of the clock and of the state of the workers."""

_KEPT = "what is finished is kept"

_LOGS = ("distributed", "distributed.client", "tornado", "tornado.application")
"""Loggers that print the tracebacks of exceptions that are also raised."""


class Executor:
    """Flies the batches of a campaign in this process, one after the other."""

    cores = 1
    """Number of batches that are flown at the same time"""

    def fly(
        self, job: Job, text: str, batches: Iterable[int], label: Callable[[int], str] = "batch {}".format
    ) -> Iterator[tuple[int, bytes]]:
        """Fly batches; yield the number and the result of each, in any order. ``label`` names a batch in messages.

        Raises:
            RunError: A batch crashes a worker, a worker cannot start or has another version, or the scheduler is lost.
        """
        for batch in batches:
            yield batch, job(text, batch)


class _PoolExecutor(Executor, ABC):
    """Flies batches in a pool of workers. After :data:`QUIET_TIME` without a result, calls ``notice`` once a cause."""

    def __init__(self, notice: Notice) -> None:
        self._notice = notice
        self._noticed: set[str] = set()

    def fly(
        self, job: Job, text: str, batches: Iterable[int], label: Callable[[int], str] = "batch {}".format
    ) -> Iterator[tuple[int, bytes]]:
        waiting, flying = iter(batches), dict[Future[bytes], int]()
        try:
            while True:
                for batch in islice(waiting, max(0, _AHEAD * max(self.cores, 1) - len(flying))):
                    flying[self._submit(job, text, batch)] = batch
                if not flying:
                    return
                for future in self._first(flying, label):
                    try:
                        result = self._result(future)
                    except BrokenProcessPool:
                        unfinished = sorted(flying.values())
                        flying.clear()
                        self._renew()
                        for batch in unfinished:
                            yield batch, self._alone(job, text, batch, label)
                        break
                    yield flying.pop(future), result
        finally:
            for future in flying:
                future.cancel()

    def _alone(self, job: Job, text: str, batch: int, label: Callable[[int], str]) -> bytes:
        """Return the result of a batch that flies with no other in flight; a ``RunError`` if its worker dies twice."""
        for _ in range(2):  # the first failure may be that of an idle worker process
            future = self._submit(job, text, batch)
            try:
                self._first({future: batch}, label)
                return self._result(future)
            except BrokenProcessPool:
                self._renew()
        raise RunError(f"campaign: {label(batch)}: the worker process ended; {_KEPT}")

    def _first(self, flying: dict[Future[bytes], int], label: Callable[[int], str]) -> Collection[Future[bytes]]:
        """Wait until at least one batch is finished, and return the futures of the finished batches."""
        due = time.monotonic() + QUIET_TIME
        while not (done := wait(flying, _LOOK, FIRST_COMPLETED).done):
            obstacle = self._obstacle()
            if time.monotonic() > due and obstacle not in self._noticed:
                self._noticed.add(obstacle)
                first, others = label(min(flying.values())), len(flying) - 1
                self._notice(f"waiting for {first}{f' and {others} more' if others else ''}{obstacle}")
        return done

    @abstractmethod
    def _submit(self, job: Job, text: str, batch: int) -> Future[bytes]:
        """Submit a batch to the pool, and return its future."""

    @abstractmethod
    def _result(self, future: Future[bytes]) -> bytes:
        """Return the result of a finished batch."""

    def _renew(self) -> None:
        """Replace a pool that is broken."""

    @abstractmethod
    def _obstacle(self) -> str:
        """Return why results may never come, as the end of a message; empty if the batches may just take long."""


class ProcessExecutor(_PoolExecutor):
    """Flies the batches in processes of this machine; when one of them dies, all are replaced.

    Campaigns and results are passed in files, not through the pool's pipes: if a process were killed while a long text
    is in a pipe, the pool would wait for ever to read or write the rest.
    """

    def __init__(self, workers: int, notice: Notice = lambda words: None) -> None:
        """Start ``workers`` processes."""
        super().__init__(notice)
        self.cores = workers
        self._start()

    def pids(self) -> list[int | None]:
        """Return the process identifiers of the workers."""
        return [process.pid for process in self._processes()]

    def close(self, *, kill: bool = False) -> None:
        """End the processes: at once with ``kill``, otherwise after the batches that they are flying."""
        if kill:
            for process in self._processes():
                process.kill()
        self._pool.shutdown(cancel_futures=True)
        self._folder.cleanup()

    def _start(self) -> None:
        self._folder = TemporaryDirectory(prefix="hsv_results_")
        self._others = set(multiprocessing.active_children())
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(self.cores, context, end_with_parent, (os.getpid(),))
        for _ in range(self.cores):  # one task per process, so that all processes start now
            self._call(int)

    def _processes(self) -> list[BaseProcess]:
        return [child for child in multiprocessing.active_children() if child not in self._others]

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        # A worker process that starts here must never receive Ctrl-C, because this process ends it.
        with ctrl_c_held_back():
            try:
                return self._pool.submit(function, *arguments)
            except OSError as error:
                raise RunError(f"campaign: a worker process cannot be started ({reason(error)})") from error

    def _renew(self) -> None:
        self.close(kill=True)
        self._start()

    def _submit(self, job: Job, text: str, batch: int) -> Future[bytes]:
        try:
            return self._call(_to_file, job, self._written(text), batch)
        except BrokenProcessPool:  # an idle process died
            self._renew()
            return self._call(_to_file, job, self._written(text), batch)

    def _written(self, text: str) -> Path:
        """Write the text of a campaign to a file, unless this was done before, and return the path of the file."""
        path = Path(self._folder.name, sha256(text.encode()).hexdigest())
        if not path.exists():
            path.write_text(text, encoding="utf-8")
        return path

    def _result(self, future: Future[bytes]) -> bytes:
        path = Path(future.result().decode())
        result = path.read_bytes()
        path.unlink()
        return result

    def _obstacle(self) -> str:
        stopped = []
        for pid in self.pids():
            with suppress(OSError):
                if Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(") ")[2].startswith("T"):
                    stopped.append(str(pid))
        return f": stopped worker process {', '.join(stopped)}" if stopped else ""


def _to_file(job: Job, campaign: Path, batch: int) -> bytes:
    """Fly a batch of the campaign whose text is in a file; return the path, as bytes, of a file with the result."""
    path = campaign.with_name(f"{batch}")
    path.write_bytes(job(campaign.read_text(encoding="utf-8"), batch))
    return bytes(path)


class DaskExecutor(_PoolExecutor):
    """Flies the batches on the workers of a Dask scheduler, which gives those of a lost worker to another one."""

    def __init__(self, client: Any, notice: Notice = lambda words: None) -> None:
        super().__init__(notice)
        self._client = client
        self._pool: Pool = client.get_executor(pure=False)

    @property
    def cores(self) -> int:  # type: ignore[override]
        """Number of threads of all workers."""
        if self._client.status != "running":
            raise self._lost()
        try:
            return sum(self._client.nthreads().values())
        except OSError as error:
            raise self._lost() from error

    def _submit(self, job: Job, text: str, batch: int) -> Future[bytes]:
        return self._pool.submit(job, text, batch)

    def _result(self, future: Future[bytes]) -> bytes:
        from distributed import KilledWorker

        try:
            return future.result()
        except KilledWorker as error:
            raise RunError(f"campaign: the same batch crashed several workers ({error}); {_KEPT}") from error
        except ImportError as error:
            raise RunError(f"campaign: a worker that came later has another program ({error}); {_KEPT}") from error
        except (CancelledError, OSError) as error:
            raise self._lost() from error

    def _obstacle(self) -> str:
        return "" if self.cores else ": the scheduler has no workers"

    def _lost(self) -> RunError:
        return RunError(f"campaign: the scheduler is lost; {_KEPT}")


@contextmanager
def make_executor(workers: int, scheduler: str = "", notice: Notice = lambda words: None) -> Iterator[Executor]:
    """Yield an executor that uses the workers of a Dask scheduler, worker processes on this machine, or this process.

    Args:
        workers: Number of processes: 0 for one per processor, 1 to fly in this process. Must be 0 with a scheduler.
        scheduler: Address of a Dask scheduler; empty: fly on this machine.
        notice: Called with a message when the campaign has to wait.

    Raises:
        CampaignError: The number or the address is not admissible, no scheduler answers at the address, it has no
            workers, or one of them does not answer, lacks the library or has another version of it.
        RunError: A worker process cannot be started.
    """
    require("workers", workers, Integral, "an integer from 0 to 4096")
    if not 0 <= workers <= 4096:
        raise CampaignError(f"workers = {workers}: expected 0 to 4096")
    if scheduler:
        if workers:
            raise CampaignError(f"workers = {workers}: expected no --workers with --scheduler, whose workers fly")
        with _connected(scheduler, notice) as client:
            _check_workers(client, scheduler, notice)
            yield DaskExecutor(client, notice)
        return
    workers = workers or os.cpu_count() or 1
    if workers == 1:
        yield Executor()
        return
    processes = ProcessExecutor(workers, notice)
    try:
        yield processes
    except BaseException:
        processes.close(kill=True)  # the batches in flight may take minutes
        raise
    processes.close()


@contextmanager
def _connected(address: str, notice: Notice) -> Iterator[Any]:
    """Yield a client of the scheduler at ``address``, which has at least one worker; a ``CampaignError`` otherwise."""
    import asyncio

    from distributed import Client
    from distributed.comm import get_address_host_port

    try:
        host, port = get_address_host_port(address)
        if not host or not 0 < port < 2**16:
            raise ValueError("no host, or no such port")
    except ValueError as error:
        raise CampaignError(f"scheduler = {address!r}: {error}; expected an address as tcp://host:8786") from error
    silent = CampaignError(f"scheduler = {address!r}: no answer, expected a running Dask scheduler")
    with ExitStack() as stack:
        for logger in map(logging.getLogger, _LOGS):
            stack.callback(logger.setLevel, logger.level)
            logger.setLevel(logging.CRITICAL)
        waiting = partial(notice, f"waiting for the scheduler {address}")
        try:
            if not asyncio.run(_answers(address, waiting)):
                raise silent
            client = stack.enter_context(Client(address, timeout=ANSWER, set_as_default=False))
        except (OSError, ValueError, TypeError) as error:
            raise silent from error
        if not client.nthreads():
            notice("waiting for the scheduler's workers")
        try:
            client.wait_for_workers(1, WORKERS)
        except TimeoutError as error:
            raise CampaignError(
                f"scheduler = {address!r}: no workers after {WORKERS:g} s, expected one at least"
            ) from error
        yield client


async def _answers(address: str, waiting: Callable[[], None]) -> bool:
    """Return whether a Dask scheduler answers within :data:`ANSWER` seconds.

    After :data:`QUIET_TIME` seconds without an answer, ``waiting`` is called once. Dask's own client is not used here,
    because Ctrl-C does not interrupt it while it waits.
    """
    import asyncio

    from distributed.core import rpc
    from distributed.security import Security

    arguments = Security().get_connection_args("client")
    async with rpc(address, timeout=ANSWER, connection_args=arguments) as scheduler:
        identity = asyncio.ensure_future(scheduler.identity())
        if not (await asyncio.wait([identity], timeout=QUIET_TIME))[0]:
            waiting()
            await asyncio.wait([identity], timeout=ANSWER - QUIET_TIME)
        if not identity.done():
            identity.cancel()
            return False
        return identity.exception() is None and identity.result().get("type") == "Scheduler"


def program() -> str:
    """Return the version of the library, and the first digits of the digest of the code that a flight uses."""
    return f"hsv {version('hsv')}, sources {code_digest()[:DIGITS]}"


def _check_workers(client: Any, address: str, notice: Notice) -> None:
    """Raise a ``CampaignError`` if any worker lacks the library, has another version or sources, or does not answer."""

    def worker_program() -> str:
        # A local function is sent by value, and so it can be called on a worker without the library.
        from hsv.flight.campaign.executors import program

        return program()

    # Use a thread, so that Ctrl-C need not wait for a worker that is stopped. The thread ends with the client.
    pool = ThreadPoolExecutor(1)
    answers = pool.submit(client.run, worker_program, on_error="return")
    pool.shutdown(wait=False)
    if not wait([answers], QUIET_TIME).done:
        notice("waiting for the answers of all workers")
    if not wait([answers], WORKERS - QUIET_TIME).done:
        raise CampaignError(f"scheduler = {address!r}: a worker does not answer, expected {program()} on each")
    for worker, answer in sorted(answers.result().items()):
        if answer == program():
            continue
        has = answer
        if isinstance(answer, Exception):
            has = "no hsv" if isinstance(answer, ModuleNotFoundError) and answer.name == "hsv" else "another hsv"
        raise CampaignError(f"scheduler = {address!r}: worker {worker} has {has}, expected {program()}, as here")

"""The same job on many items, as flights of many vehicles, in threads; and how processes begin beside Ctrl-C."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def over_threads(
    job: Callable[[Item], Result], items: Iterable[Item], progress: Callable[[int], None] = lambda done: None
) -> list[Result]:
    """Return ``job`` of every item, in order, from as many threads as there are processors.

    ``progress`` is called with the number of items done.
    """
    results = []
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for result in pool.map(job, items):
            results.append(result)
            progress(len(results))
    return results


@contextmanager
def ctrl_c_held_back() -> Iterator[None]:
    """Let Ctrl-C take effect at the end only; threads and processes that begin meanwhile never receive it.

    A cluster that is interrupted half started does not close. Such processes are ended by the command.
    """
    resource_tracker.ensure_running()  # where it is started, it lets Ctrl-C in
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

"""The same job on many items, as flights of many vehicles: compiled code runs beside other compiled code."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
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

"""The connection to somebody else's Dask scheduler."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hsv.base.errors import CampaignError

ANSWER, WORKERS = 60.0, 300.0
"""Seconds to wait for the scheduler, and for the first of its workers: a cluster may have to start machines."""

_LOGS = ("distributed", "distributed.client", "tornado", "tornado.application")
"""Loggers that put tracebacks of what is also raised on the terminal."""


@contextmanager
def connected(address: str, on_wait: Callable[[], None] = lambda: None) -> Iterator[Any]:
    """Yield the client of the scheduler at ``address``, which has a worker at least.

    Args:
        address: ``host:port``, with or without ``tcp://``, ``tls://`` and the like in front.
        on_wait: Called if there are no workers yet, before they are waited for.

    Raises:
        CampaignError: The address is none, no scheduler answers there, or no worker comes.
    """
    from distributed import Client
    from distributed.comm import get_address_host_port

    try:
        host, port = get_address_host_port(address)
        if not host or not 0 < port < 2**16:
            raise ValueError("no host, or no such port")
    except ValueError as error:
        raise CampaignError(f"scheduler = {address!r}: {error}; expected an address as tcp://host:8786") from error
    with _quiet():
        try:
            client = Client(address, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            raise CampaignError(f"scheduler = {address!r}: no answer, expected a running Dask scheduler") from error
        with client:
            if not client.nthreads():
                on_wait()
                _wait(client, address)
            yield client


def _wait(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKERS)
    except TimeoutError as error:
        raise CampaignError(
            f"scheduler = {address!r}: no workers after {WORKERS:g} s, expected one at least"
        ) from error


@contextmanager
def _quiet() -> Iterator[None]:
    loggers = [logging.getLogger(name) for name in _LOGS]
    before = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL)
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)

"""Loaded by every worker of the local cluster: Ctrl-C is for the command, which ends its workers itself."""

from __future__ import annotations

import signal


def dask_setup(worker: object) -> None:
    """Prepare a worker, as Dask asks of a module to preload."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

"""Mutual exclusion of processes by a lock file next to what it guards, which may then be deleted and recreated."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hsv.base.errors import CampaignError, reason


@contextmanager
def locked(path: Path, complaint: str) -> Iterator[None]:
    """Hold the file ``path``, which is there only as long as it is held, or its holder was killed.

    Raises:
        CampaignError: Another process holds it, and the error is ``complaint``; or it cannot be made.
    """
    while True:
        try:
            stream = path.open("w")
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CampaignError(complaint) from None
        except OSError as error:
            raise CampaignError(f"{path}: cannot be locked ({reason(error)})") from error
        with stream:
            # Its last holder may have removed it in between, and a third process made another.
            if not path.exists() or not os.path.samestat(path.stat(), os.fstat(stream.fileno())):
                continue
            try:
                yield
                return
            finally:
                path.unlink(missing_ok=True)

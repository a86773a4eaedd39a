"""The processor that the nodes of a flight share.

From the state that the plant publishes to the actuator's answer, each node waits for the one before it: the nodes never
work at the same time. On one processor nobody waits until another one, which has become idle, has woken up.
"""

from __future__ import annotations

import os
import random
import socket
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from hsv.bags.description import FAULT_INJECTOR, NOTCH_FILTER, PLANT, TUBE_MPC
from hsv.graph.exclusive import claim_processor

CHAIN = (NOTCH_FILTER.name, TUBE_MPC.name, FAULT_INJECTOR.name, PLANT.name)
"""Nodes that wait for one another in every step. The nominal trajectory is generated beside the notch filter, and other
controllers may calculate in several threads: the system places these as it likes, as it does the recorder."""


def share_processor(pids: Iterable[int]) -> socket.socket | None:
    """Keep all threads of processes to one processor, of those that this process may use, that no other flight has.

    Args:
        pids: The processes.

    Returns:
        What keeps the processor from other flights of this machine while it is open. None, and nothing is changed, if
        this process may use only one processor, or other flights have all of them.
    """
    allowed = list(os.sched_getaffinity(0))
    if len(allowed) < 2:
        return None
    # In containers, flights do not know of one another: they should not all choose the same processor.
    random.shuffle(allowed)
    for processor in allowed:
        held = claim_processor(processor)
        if held is None:
            continue
        for pid in pids:
            _keep_to(processor, pid)
        return held
    return None


def _keep_to(processor: int, pid: int) -> None:
    kept: set[Path] = set()
    # A process or a thread may end at any time.
    with suppress(OSError):
        # One that a thread starts before it is kept itself may still use all processors.
        while new := set(Path(f"/proc/{pid}/task").iterdir()) - kept:
            for thread in new:
                with suppress(OSError):
                    os.sched_setaffinity(int(thread.name), {processor})
            kept |= new

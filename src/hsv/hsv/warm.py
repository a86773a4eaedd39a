"""Compile once what every command and node needs, so that none of them does: ``python -m hsv.warm``."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import BrokenExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from hsv.ahead_of_time import SourcesChangedError, build, recording
from hsv.campaign.campaign import plan
from hsv.campaign.envelope import Envelope
from hsv.campaign.sample_runner import SampleRunner
from hsv.control.estimator_parameters import PROCESS_PARAMETERS
from hsv.interruption import take_interrupts
from hsv.kept_library import keep, restored
from hsv.precompiled import state_of_sources, why_none
from hsv.simulation.assembly import assemble, flight_parameters
from hsv.simulation.blocks import steps
from hsv.simulation.closed_loop import fly
from hsv.simulation.metrics import flight_metrics
from hsv.simulation.scenario import load_scenario

_MOST_PROCESSES = 4
"""At most: one that compiles all takes 0.75 GB of memory, and the largest function a fifth of the time of all."""


_SOON_DONE = {"duration": 0.1, **{parameter.name: 1.0 for parameter in PROCESS_PARAMETERS}}
"""A short flight, with process noise for which the estimator's gain converges in a quarter of the iterations."""


def warm() -> None:
    """Call once what commands and nodes call: step every component, fly every compiled loop."""
    # First what takes longest to compile, so that the other processes compile the rest meanwhile.
    runner, envelope = SampleRunner(plan("case1")), Envelope.empty()
    for own in runner.fly_piece(5):
        envelope.add(own.curves, 5)
        runner.outcome(own)
    for name in ("case1", "case1_active", "case1_realistic", "case1_hard_sensors"):
        components = assemble(flight_parameters(load_scenario(name)) | _SOON_DONE)
        flown = fly(components).data()
        flight_metrics(flown)
        columns: dict[str, Any] = {
            name: value.copy() for name, value in vars(flown).items() if isinstance(value, np.ndarray)
        }
        flight_metrics(replace(flown, **columns))  # as they come from a bag, each on its own
        for _ in steps(components):
            pass


def _ahead_of_time(processes: int) -> None:
    with recording(processes) as calls:
        warm()
    build(calls)


if __name__ == "__main__":
    take_interrupts()
    state, reason = state_of_sources(), why_none()
    try:
        if state is None:
            raise SourcesChangedError("sources were changed meanwhile; run it again")
        if not reason and not restored(state):
            try:
                _ahead_of_time(min(_MOST_PROCESSES, os.cpu_count() or 1))
            except BrokenExecutor:  # one was killed, as where the memory does not suffice for several
                _ahead_of_time(0)
            keep(state)
    except KeyboardInterrupt:
        print("python -m hsv.warm: interrupted", file=sys.stderr)
        sys.exit(130)
    except SourcesChangedError as error:
        sys.exit(f"python -m hsv.warm: {error}")
    except (OSError, subprocess.CalledProcessError, AttributeError) as error:
        # No compiler to link with, or a llvmlite before 0.44: only to start a command or node takes longer.
        reason = str(getattr(error, "stderr", None) or error)
    if reason:
        print(f"python -m hsv.warm: nothing compiled ahead of time: {reason}", file=sys.stderr)
        warm()  # compiled by numba when it is called

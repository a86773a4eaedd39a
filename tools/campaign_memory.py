"""Fly a large campaign and print what it takes on the way: python3 tools/campaign_memory.py 100000, after env.sh.

After each tenth of the flights: wall time, pace, and the resident memory of the process that keeps the results and of
its largest worker. In the end, the size of the result, and what ten times as many flights would take.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

import psutil

from hsv.campaign.campaign import plan
from hsv.campaign.executors import make_executor
from hsv.campaign.run import run_campaign
from hsv.campaign.store import ResultStore

MIB = 2.0**20


def memory() -> tuple[float, float]:
    """Return the resident memory (MiB) of this process and of the largest process below it, zero without one."""
    own = psutil.Process()
    below = [process.memory_info().rss for process in own.children(recursive=True)]
    return own.memory_info().rss / MIB, max(below, default=0) / MIB


def main() -> int:
    """Fly the campaign and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("flights", type=int, help="number of flights, at least 10")
    parser.add_argument("--scenario", default="case1")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    if arguments.flights < 10:
        parser.error(f"flights = {arguments.flights}: expected at least 10")
    campaign = plan(arguments.scenario, samples=arguments.flights)
    print("| flights | time, s | flights a second | this process, MiB | largest worker, MiB |")
    print("| ---: | ---: | ---: | ---: | ---: |", flush=True)
    tenth = -(-arguments.flights // 10)
    due = tenth
    with tempfile.TemporaryDirectory() as folder, make_executor(arguments.workers) as executor:
        store = ResultStore(Path(folder, "result.parquet"), campaign)
        started = time.perf_counter()

        def on_flights(done: int) -> None:
            nonlocal due
            if done >= min(due, arguments.flights):
                due = done + tenth
                seconds, (own, worker) = time.perf_counter() - started, memory()
                print(f"| {done} | {seconds:.0f} | {done / seconds:.0f} | {own:.0f} | {worker:.0f} |", flush=True)

        run_campaign(campaign, store, executor, progress=on_flights)
        seconds, size = time.perf_counter() - started, store.out.stat().st_size
    own, _ = memory()
    print(f"\nresult written after {seconds:.0f} s: {size / MIB:.1f} MiB, this process {own:.0f} MiB")
    print(f"ten times as many flights: {seconds / 360.0:.1f} h, {10 * size / MIB:.0f} MiB")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Fly a large campaign and print what it takes on the way: python3 tools/campaign_memory.py 100000, after env.sh.

At the first batch to end after each tenth of the flights: wall time, pace, and the resident memory of the process that
keeps the results and of its largest worker. A batch has 32 to 256 flights, so that small campaigns have fewer rows. In
the end, the size of the result, that of its batches before it was written, and the largest resident memory of
this process until then.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from pathlib import Path
from typing import NoReturn

import psutil

from hsv.base.errors import HsvError
from hsv.flight.campaign.campaign import MAX_SAMPLES, Campaign, plan
from hsv.flight.campaign.executors import make_executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.store import ResultStore

MIB = 2.0**20


def memory() -> tuple[float, float]:
    """Return the resident memory (MiB) of this process and of the largest process below it, zero without one."""
    own = psutil.Process()
    below = [process.memory_info().rss for process in own.children(recursive=True)]
    return own.memory_info().rss / MIB, max(below, default=0) / MIB


def whole(text: str) -> int:
    """Return the whole number in ``text``.

    Raises:
        argparse.ArgumentTypeError: It is none.
    """
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number") from None


class Arguments(argparse.ArgumentParser):
    """A parser of arguments that refuses them on one line."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2."""
        self.exit(2, f"{Path(sys.argv[0]).name}: error: {message}\n")


def main() -> int:
    """Fly the campaign and print the table; return the exit code."""
    parser = Arguments(description=__doc__.partition("\n")[0])
    parser.add_argument("flights", type=whole, help=f"number of flights, 10 to {MAX_SAMPLES}")
    parser.add_argument("--scenario", default="case1", help="shipped scenario or path of a TOML file")
    parser.add_argument("--workers", type=whole, default=0, help="number of processes; 0: one per processor")
    arguments = parser.parse_args()
    if not 10 <= arguments.flights <= MAX_SAMPLES:
        parser.error(f"flights = {arguments.flights}: expected 10 to {MAX_SAMPLES}")
    try:
        fly(plan(arguments.scenario, samples=arguments.flights), arguments.workers)
    except HsvError as error:
        parser.error(str(error))
    return 0


def fly(campaign: Campaign, workers: int) -> None:
    """Fly a campaign and print what it takes.

    Raises:
        CampaignError: The number of workers is not admissible.
    """
    tenth = -(-campaign.samples // 10)
    due = tenth
    with tempfile.TemporaryDirectory() as folder, make_executor(workers) as executor:
        print("| flights | time, s | flights a second | this process, MiB | largest worker, MiB |")
        print("| ---: | ---: | ---: | ---: | ---: |", flush=True)
        store = ResultStore(Path(folder, "result.parquet"), campaign)
        started = time.perf_counter()
        flown, parts = 0.0, 0

        def on_flights(done: int) -> None:
            nonlocal due, flown, parts
            if done >= min(due, campaign.samples):
                due = done + tenth
                flown, (own, worker) = time.perf_counter() - started, memory()
                print(f"| {done} | {flown:.0f} | {done / flown:.0f} | {own:.0f} | {worker:.0f} |", flush=True)
            if done == campaign.samples:
                parts = sum(file.stat().st_size for file in store.folder.iterdir())

        run_campaign(campaign, store, executor, progress=on_flights)
        writing, size = time.perf_counter() - started - flown, store.out.stat().st_size
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"\nbatches: {parts / MIB:.1f} MiB; result: {size / MIB:.1f} MiB, written in {writing:.1f} s")
    print(f"this process, at most: {most:.0f} MiB")


if __name__ == "__main__":
    sys.exit(main())

"""Monte Carlo: flights a second of one worker and of many."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from hsv.bench.figure import Figure
from hsv.campaign.campaign import plan
from hsv.campaign.executors import make_executor
from hsv.campaign.run import run_campaign
from hsv.campaign.store import ResultStore


def over_workers(repeats: int, workers: int, samples: int = 1024) -> list[Figure]:
    """Return the pace of ``workers`` against as many times that of one, flights of Case 1, workers warm."""
    paces: dict[int, list[float]] = {1: [], workers: []}
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        for repeat in range(repeats):
            for count, measured in paces.items():
                measured.append(_pace(Path(folder), count, samples, repeat))
    one = tuple(workers * pace for pace in paces[1])
    return [
        Figure(
            "montecarlo",
            f"flights of Case 1 a second, {workers} workers",
            f"{workers} x one worker",
            "1/s",
            tuple(paces[workers]),
            one,
            "least",
            0.9,
        )
    ]


def corners(workers: int) -> list[Figure]:
    """Return the wall time of the 1024 corners of Case 1, start of the workers included."""
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        started = time.perf_counter()
        campaign = plan("case1", method="corners")
        with make_executor(workers) as flying:
            run_campaign(campaign, ResultStore(Path(folder, "corners.parquet"), campaign), flying)
        seconds = time.perf_counter() - started
    what = f"1024 corners of Case 1, {workers} workers, their start included"
    return [Figure("corners", what, "", "s", (seconds,), (), "most", 15.0)]


def _pace(folder: Path, workers: int, samples: int, repeat: int) -> float:
    times: list[float] = []
    flown: list[int] = []

    def progress(done: int) -> None:
        times.append(time.perf_counter())
        flown.append(done)

    campaign = plan("case1", samples=samples, seed=repeat)
    with make_executor(workers) as flying:
        if workers > 1:
            warm = plan("case1", samples=8 * workers, seed=10**6 + repeat)
            run_campaign(warm, ResultStore(folder / f"warm_{repeat}.parquet", warm), flying)
        run_campaign(campaign, ResultStore(folder / f"{workers}_{repeat}.parquet", campaign), flying, progress=progress)
    return flown[-1] / (times[-1] - times[0])

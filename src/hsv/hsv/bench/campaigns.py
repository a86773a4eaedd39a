"""Monte Carlo: flights a second of one worker and of many."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from statistics import median

from hsv.bench.c_build import FLAGS, c_flight
from hsv.bench.figure import Figure
from hsv.core import lanes
from hsv.flight.assembly import assemble_flight
from hsv.flight.campaign.campaign import plan
from hsv.flight.campaign.executors import make_executor
from hsv.flight.campaign.run import run_campaign
from hsv.flight.campaign.sample_runner import sample_runner
from hsv.flight.campaign.store import ResultStore
from hsv.flight.history import History
from hsv.flight.scenario import load_scenario


def over_workers(repeats: int, workers: int, samples: int = 1024) -> list[Figure]:
    """Return the pace of ``workers`` against as many times that of one, flights of Case 1, workers warm.

    The note has the same ratio for the C build, which is what the processors allow.
    """
    paces: dict[int, list[float]] = {1: [], workers: []}
    paces_c: dict[int, list[float]] = {1: [], workers: []}
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        for repeat in range(repeats):
            for count, measured in paces.items():
                measured.append(_pace(Path(folder), count, samples, repeat))
                paces_c[count].append(_pace_c(count, samples // 4))
    one = tuple(workers * pace for pace in paces[1])
    gained_c = median(many / (workers * single) for many, single in zip(paces_c[workers], paces_c[1], strict=True))
    return [
        Figure(
            "montecarlo",
            f"flights of Case 1 a second, {workers} workers",
            f"{workers} x one worker",
            "1/s",
            tuple(paces[workers]),
            one,
            "least",
            0.95,
            note=f"the C build alone {gained_c:.3g}",
        )
    ]


def corners(repeats: int, workers: int) -> list[Figure]:
    """Return the wall time of the 1024 corners of Case 1, alone and against as many flights of the C build.

    The campaign is timed with its metrics and its file, in the first figure also with the start of its workers. The C
    build flies alone, on as many workers.
    """
    campaign = plan("case1", method="corners")
    ours, theirs = [], []
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:

        def fly_corners(name: str) -> None:
            run_campaign(campaign, ResultStore(Path(folder, name), campaign), flying)

        started = time.perf_counter()
        with make_executor(workers) as flying:
            fly_corners("first.parquet")
            first = time.perf_counter() - started
            list(flying.fly(_build_c, campaign.text, range(workers)))
            for repeat in range(repeats):
                started = time.perf_counter()
                fly_corners(f"{repeat}.parquet")
                ours.append(time.perf_counter() - started)
                started = time.perf_counter()
                list(flying.fly(_fly_c, campaign.text, range(len(campaign.batches))))
                theirs.append(time.perf_counter() - started)
    what = f"1024 corners of Case 1, {workers} workers"
    against = f"as many flights of the C build, {' '.join(FLAGS)}, alone on as many workers"
    limit, goal = (0.4, None) if lanes() == 8 else (0.6, 0.35)
    return [
        Figure("corners", f"{what}, their start included", "", "s", (first,), (), "most", 15.0),
        Figure(
            "corners_c",
            f"{what}, metrics and file included",
            against,
            "s",
            tuple(ours),
            tuple(theirs),
            "most",
            limit,
            goal,
            f"{lanes()} flights side by side",
        ),
    ]


@cache
def _c_flight() -> Callable[[], History]:
    return c_flight(assemble_flight(load_scenario("case1")))


def _build_c(text: str, number: int) -> bytes:
    _c_flight()()
    return b""


def _fly_c(text: str, batch: int) -> bytes:
    for _ in sample_runner(text).campaign.flights(batch):
        _c_flight()()
    return b""


def _pace_c(workers: int, samples: int) -> float:
    """Return the flights a second of the C build alone, on so many warm workers."""
    campaign = plan("case1", samples=samples)
    with make_executor(workers) as flying:
        list(flying.fly(_build_c, campaign.text, range(workers)))
        started = time.perf_counter()
        list(flying.fly(_fly_c, campaign.text, range(len(campaign.batches))))
        return samples / (time.perf_counter() - started)


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

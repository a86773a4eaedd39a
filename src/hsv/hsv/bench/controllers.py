"""Cost of custom controllers, compared with the law that the loop has in itself."""

from __future__ import annotations

import ctypes
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from hsv.bench.c_build import compiled
from hsv.bench.figure import Figure, interleaved
from hsv.control.controller import ControllerInput, ExternalController, StepKernel
from hsv.control.export import SOURCE, controller_files
from hsv.control.library import LibraryController, load_block
from hsv.control.tube_law import TubeLaw
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import Components, fly
from hsv.flight.scenario import load_scenario

_FLIGHTS, _DURATION = 40, 2.0
"""Short flights with the input held: the vehicle alone is unstable, and leaves the range of the model after 3.5 s."""


class _Holding:
    """A controller in Python that does nothing: the input stays that of the trim."""

    def __init__(self, held: np.ndarray) -> None:
        self._held = tuple(held.tolist())

    def reset(self) -> None:
        pass

    def step(self, inputs: ControllerInput) -> tuple[float, ...]:
        return self._held


def a_step_in_python(repeats: int) -> list[Figure]:
    """Return the cost of a step of Python classes: of one that does nothing, and of the example if it is installed."""
    flight = assemble_flight(load_scenario("case1", {"duration": f"{_DURATION} s", "fault": []}))
    held = flight.plant.initial.input
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        source = Path(str(files("hsv.bench").joinpath("holding.c")))
        hold = ctypes.CDLL(str(compiled(Path(folder, "holding.so"), [source]))).hold
    address = ctypes.cast(hold, ctypes.c_void_p).value or 0
    kernel = SimpleNamespace(kernel=StepKernel(address, np.zeros(0), held))
    figures = [
        _beside(
            "python_class",
            "a step of a class in Python that does nothing",
            "the same in C",
            _several(_flown_by(flight, _Holding(held)), _FLIGHTS),
            _several(_flown_by(flight, kernel), _FLIGHTS),
            _FLIGHTS * flight.plant.steps,
            repeats,
            5e-6,
        )
    ]
    if find_spec("hsv_lqr") is not None:
        own, shipped = (assemble_flight(load_scenario("case1", c)) for c in (_LQR, {}))
        figures.append(
            _beside(
                "python_lqr",
                "a step of examples/lqr, its own time included",
                "the shipped loop",
                lambda: fly(own),
                lambda: fly(shipped),
                own.plant.steps,
                max(2, repeats // 4),
            )
        )
    return figures


_LQR = {"controller": "lqr", "design": "", "notch.enabled": False}


def laws_in_c(repeats: int) -> list[Figure]:
    """Return Case 1 with the exported law as a custom function in C, against the loop with its own law.

    Both do the same work, and give the same bits.
    """
    shipped = assemble_flight(load_scenario("case1"))
    with tempfile.TemporaryDirectory(prefix="hsv_bench_") as folder:
        assert isinstance(shipped.controller, TubeLaw)
        for file, text in controller_files(shipped.controller.design).items():
            Path(folder, file).write_text(text, encoding="utf-8")
        library = compiled(Path(folder, "controller.so"), [Path(folder, SOURCE)])
        scenario = Path(folder, "own.toml")
        scenario.write_text(f'extends = "case1"\ncontroller = "{library.name}:tube_law"\n', encoding="utf-8")
        own = assemble_flight(load_scenario(str(scenario)))
        assert isinstance(own.controller, LibraryController)
        kernel = replace(own, controller=own.controller.loaded(load_block(library, "tube_law").address))
        equal = {f.fingerprint for f in (fly(shipped), fly(own), fly(kernel))}
        note = "the same bits" if len(equal) == 1 else "other bits"
        jobs: dict[str, tuple[str, Components, Callable[[], float]]] = {
            "c_function": ("Case 1, 200 s, the tube law as a custom function in C", kernel, time.thread_time),
            "c_library": ("Case 1, 200 s, the tube law in a C library, in its process", own, time.perf_counter),
        }
        return [
            Figure(
                name,
                what,
                "the shipped loop",
                "s",
                *interleaved(lambda parts=parts: fly(parts), lambda: fly(shipped), repeats, clock),  # type: ignore[misc]
                "most",
                1.1,
                note=note,
            )
            for name, (what, parts, clock) in jobs.items()
        ]


def _flown_by(flight: Components, controller: Any) -> Components:
    return replace(flight, controller=ExternalController("holding", controller, flight.plant.data.vehicle))


def _several(flight: Components, count: int) -> Callable[[], object]:
    return lambda: [fly(flight) for _ in range(count)]


def _beside(
    name: str,
    what: str,
    against: str,
    ours: Callable[[], object],
    theirs: Callable[[], object],
    steps: int,
    repeats: int,
    limit: float | None = None,
) -> Figure:
    """Return the time (s) that a step of ours takes beyond one of theirs."""
    pairs = zip(*interleaved(ours, theirs, repeats), strict=True)
    more = tuple((a - b) / steps for a, b in pairs)
    return Figure(name, f"{what}, beyond one of {against}", "", "s", more, (), "most" if limit else "", limit)

"""The command ``hsv simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from hsv.base.units import UnitSystem
from hsv.cli.options import JsonOption, ScenarioArgument, UnitsOption
from hsv.cli.targets import check_target, writing


def simulate(
    scenario: ScenarioArgument = "case1",
    units: UnitsOption = UnitSystem.metric,
    out: Annotated[Path | None, typer.Option(help="Also save the time histories to this .npz file (SI).")] = None,
    json: JsonOption = False,
) -> None:
    """Fly a scenario in this process, without ROS, with the same numbers as the graph, bit for bit.

    Example: hsv simulate case1 --units paper
    """
    import time

    import numpy as np

    from hsv.cli.summary import report_flight
    from hsv.control.design_file import find_design, read_design
    from hsv.control.design_parameters import digest
    from hsv.flight.assembly import assemble_flight, blamed_on
    from hsv.flight.closed_loop import fly
    from hsv.flight.coverage import uncovered_of
    from hsv.flight.metrics import flight_metrics
    from hsv.flight.scenario import load_scenario
    from hsv.model.plant import FlightStatus

    if out:
        check_target(out, "out")
    loaded = load_scenario(scenario)
    with blamed_on(loaded):
        design = read_design(find_design(loaded.design)) if loaded.design else None
    components = assemble_flight(loaded, design)
    started = time.perf_counter()
    flight = fly(components)
    wall = time.perf_counter() - started
    if out:
        with writing(out, "out"), out.open("wb") as stream:
            columns: dict[str, Any] = {"time": flight.time, **flight.history.columns()}
            np.savez_compressed(stream, **columns)
    report_flight(
        loaded,
        flight_metrics(flight.data()),
        fingerprint=flight.fingerprint,
        design_hash=design.digest if design else digest({}),
        ending="diverged" if flight.status is FlightStatus.DIVERGED else "finished",
        wall_time=wall,
        simulated_time=float(flight.time[-1]),
        units=units,
        json=json,
        not_covered=uncovered_of(loaded, design),
    )

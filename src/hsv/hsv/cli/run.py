"""The command ``hsv run``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import JsonOption, ScenarioArgument, UnitsOption
from hsv.cli.output import Units, report_line


def run(
    scenario: ScenarioArgument = "case1",
    real_time_factor: Annotated[float, typer.Option(help="Pace: 1 is real time, 0 as fast as possible.")] = 0.0,
    composed: Annotated[bool, typer.Option("--composed", help="All nodes in one process: faster, same bytes.")] = False,
    bag: Annotated[Path | None, typer.Option(help="Bag to write; default: bags/<scenario>_<UTC>.")] = None,
    namespace: Annotated[
        str,
        typer.Option(help="ROS namespace of all nodes and topics, such as /veh1: several graphs fly in one domain."),
    ] = "/",
    step_timeout: Annotated[float, typer.Option(help="Wall time (s) after which a silent node ends the run.")] = 10.0,
    report: Annotated[bool, typer.Option(help="Write the report into the bag's folder.")] = True,
    verbose: Annotated[bool, typer.Option("--verbose", help="Show what the nodes say.")] = False,
    units: UnitsOption = Units.si,
    json: JsonOption = False,
) -> None:
    """Fly a scenario with the graph of ROS 2 nodes as separate processes, recorded to an MCAP bag.

    Example: hsv run case1 --units paper
    """
    import time

    from hsv.cli.progress import flight as flight_bar
    from hsv.cli.summary import report_flight
    from hsv.errors import QuantityError, RecordingError
    from hsv.graph.description import checked_namespace
    from hsv.graph.flight import fly_graph
    from hsv.graph.launcher import WARNING
    from hsv.graph.preparation import prepare
    from hsv.recording.flight import flight_data, flight_fingerprint
    from hsv.recording.reader import Bag
    from hsv.simulation.metrics import flight_metrics

    if not 0.0 <= real_time_factor <= 1000.0:
        raise QuantityError(f"real-time-factor = {real_time_factor}: expected 0 (as fast as possible) to 1000")
    if not 0.1 <= step_timeout <= 1e6:
        raise QuantityError(f"step-timeout = {step_timeout}: expected at least 0.1 (seconds)")
    namespace = checked_namespace(namespace)
    prepared = prepare(scenario, bag=bag, real_time_factor=real_time_factor, step_timeout=step_timeout)
    loaded = prepared.scenario
    clock: dict[str, float] = {}

    def line(node: str, text: str) -> None:
        if verbose or WARNING in text:
            report_line(node, text)

    with flight_bar(loaded.name, loaded.duration, prepared.steps) as show:

        def step(number: int) -> None:
            clock.setdefault("start", time.monotonic())
            clock["end"] = time.monotonic()
            show(number)

        diverged = fly_graph(prepared, composed=composed, namespace=namespace, on_step=step, on_line=line)
    recorded = Bag(prepared.bag)
    data = flight_data(recorded)
    extra = {"bag": str(prepared.bag)}
    unwritten = None
    if report:
        from hsv.recording.report.page import write_report

        page = prepared.bag / "report.html"
        try:
            write_report([recorded], page, paper_units=units is Units.paper)
            extra["report"] = str(page)
        except RecordingError as error:
            unwritten = error  # the flight itself is whole, and told first
    report_flight(
        loaded,
        flight_metrics(data),
        fingerprint=flight_fingerprint(recorded),
        design_hash=recorded.custom_data["design_hash"],
        diverged_at=float(data.time[-1]) if diverged else None,
        wall_time=clock["end"] - clock["start"],
        simulated_time=float(data.time[-1]),
        units=units,
        json=json,
        extra=extra,
    )
    if unwritten:
        raise unwritten

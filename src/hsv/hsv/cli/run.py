"""The command ``hsv run``."""

from __future__ import annotations

from typing import Annotated

import typer

from hsv.base.units import UnitSystem
from hsv.cli.options import (
    ComposedOption,
    ExternalOption,
    JsonOption,
    LiveOption,
    LivePortOption,
    NamespaceOption,
    NewBagOption,
    RealTimeFactorOption,
    ReportOption,
    ScenarioArgument,
    StepTimeoutOption,
    UnitsOption,
    live_port_of,
)
from hsv.cli.output import Interrupted, report_line


def run(
    scenario: ScenarioArgument = "case1",
    live: LiveOption = False,
    live_port: LivePortOption = None,
    real_time_factor: RealTimeFactorOption = None,
    composed: ComposedOption = False,
    external: ExternalOption = False,
    bag: NewBagOption = None,
    namespace: NamespaceOption = "/",
    step_timeout: StepTimeoutOption = None,
    report: ReportOption = True,
    verbose: Annotated[bool, typer.Option("--verbose", help="Show the log output of the nodes.")] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Fly a scenario with the graph of ROS 2 nodes as separate processes, recorded to an MCAP bag.

    After an interruption the bag contains the steps flown so far; before the first step, no bag is left.

    Example: hsv run case1 --units paper
    """
    import time

    from hsv.bags.description import LIVE, checked_namespace
    from hsv.cli.conclude import conclude_flight
    from hsv.cli.progress import flight as flight_bar
    from hsv.graph.flight import fly_graph
    from hsv.graph.launcher import WARNING
    from hsv.graph.preparation import prepare

    namespace = checked_namespace(namespace)
    prepared = prepare(
        scenario,
        bag=bag,
        real_time_factor=real_time_factor,
        step_timeout=step_timeout,
        composed=composed,
        external=external,
        live_port=live_port_of(live, live_port),
    )
    loaded = prepared.scenario
    clock: dict[str, float] = {}

    def line(node: str, text: str) -> None:
        # Where the live view is to be seen.
        if verbose or WARNING in text or (node == LIVE.label and text.startswith("live ")):
            report_line(node, text)

    try:
        with flight_bar(loaded.name, prepared.steps, units) as shown:

            def step(number: int) -> None:
                clock.setdefault("start", time.monotonic())
                clock["end"] = time.monotonic()
                shown.step(number)

            fly_graph(prepared, namespace=namespace, on_step=step, on_line=line, on_snapshot=shown.snapshot)
    except KeyboardInterrupt:
        if not prepared.bag.is_dir():
            raise
        raise Interrupted(f"interrupted; the steps flown so far are in {prepared.bag}") from None
    conclude_flight(prepared.bag, report=report, units=units, json=json, wall_time=clock["end"] - clock["start"])

"""Commands that fly once: over DDS or in this process, and two commands for other launchers."""

from __future__ import annotations

import functools
import inspect
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hsv.base.errors import ParameterError, RecordingError
from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.options import (
    BagArgument,
    JsonOption,
    ScenarioArgument,
    SetOption,
    UnitsOption,
    check_folder,
    check_target,
    writing,
)

if TYPE_CHECKING:
    from hsv.graph.preparation import PreparedRun

RealTimeFactorOption = Annotated[
    float | None,
    Option(help="Pace: 1 is real time, 0 as fast as possible; default: 0, with --live 1.", show_default=False),
]
LiveOption = Annotated[bool, Option("--live", help="Show the flight live, on a page in the browser and in Foxglove.")]
LivePortOption = Annotated[
    int | None,
    Option(
        help="Port for Foxglove, 8765, with --live; the page has the next one. 0: any two that are free.",
        show_default=False,
    ),
]
StepTimeoutOption = Annotated[float, Option(help="Wall time (s) until a silent node ends the run.")]
NewBagOption = Annotated[Path | None, Option("--bag", help="Bag to write; default: bags/<scenario>_<UTC>.")]
ComposedOption = Annotated[bool, Option("--composed", help="All nodes in one process: faster, same bytes.")]
ExternalOption = Annotated[bool, Option("--external", help="Wait for a controller node that you start by hand.")]
NamespaceOption = Annotated[str, Option(help="ROS namespace of all nodes and topics, such as /veh1.")]
PausedOption = Annotated[bool, Option("--paused", help="Start paused; hsv set paused false resumes.")]
ReportOption = Annotated[bool, Option(help="Write the report into the bag's folder.")]
StrictOption = Annotated[bool, Option("--strict", help="Exit code 1 if a limit of the scenario is violated.")]
AllOption = Annotated[bool, Option("--all", help="Also list the metrics that the scenario does not limit.")]


@dataclass(frozen=True)
class GraphFlight:
    """A flight of the graph as the command line describes it, for hsv run and hsv prepare."""

    scenario: ScenarioArgument = "case1"
    changes: SetOption = None
    live: LiveOption = False
    live_port: LivePortOption = None
    real_time_factor: RealTimeFactorOption = None
    composed: ComposedOption = False
    external: ExternalOption = False
    bag: NewBagOption = None
    namespace: NamespaceOption = "/"
    step_timeout: StepTimeoutOption = 10.0
    paused: PausedOption = False

    def prepared(self, folder: Path | None = None) -> PreparedRun:
        """Check scenario and options, create the bag, write the parameter files (by default to a temporary folder)."""
        from hsv.graph.preparation import RunOptions, prepare

        if self.live_port is not None and not self.live:
            raise ParameterError(f"live-port = {self.live_port}: expected with --live only")
        port = (8765 if self.live_port is None else self.live_port) if self.live else None
        options = RunOptions(self.real_time_factor, self.step_timeout, self.composed, self.external, port, self.paused)
        return prepare(self.scenario, options, changes=self.changes or (), bag=self.bag, folder=folder)


def _with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the fields of GraphFlight as options in place of its first argument."""
    shared = inspect.signature(GraphFlight, eval_str=True).parameters
    [_, *own] = inspect.signature(command, eval_str=True).parameters.values()

    @functools.wraps(command)
    def with_options(**values: Any) -> None:
        command(GraphFlight(**{name: values.pop(name) for name in shared}), **values)

    with_options.__signature__ = inspect.Signature([*shared.values(), *own])  # type: ignore[attr-defined]
    return with_options


@_with_options
def run(
    flight: GraphFlight,
    report: ReportOption = True,
    verbose: Annotated[bool, Option("--verbose", help="Show the log output of the nodes.")] = False,
    strict: StrictOption = False,
    every: AllOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Fly a scenario with the graph of ROS 2 nodes as separate processes, recorded to an MCAP bag.

    After an interruption the bag contains the steps flown so far; before the first step, no bag is left.

    Example: hsv run case1 --units paper
    """
    from hsv.bags.description import LIVE, checked_namespace
    from hsv.graph.flight import fly_graph
    from hsv.graph.launcher import WARNING

    namespace = checked_namespace(flight.namespace)
    prepared = flight.prepared()
    clock: dict[str, float] = {}

    def line(node: str, text: str) -> None:
        # The user needs the addresses of the live view even without --verbose.
        if not node:
            output.errors.print(text)
        elif verbose or WARNING in text or (node == LIVE.label and text.startswith("live ")):
            output.report_line(node, text)

    try:
        with output.stages() as show:
            show(prepared.scenario.name, 0, prepared.steps)

            def step(number: int) -> None:
                clock["end"] = time.monotonic()
                clock.setdefault("start", clock["end"])
                show(prepared.scenario.name, number, prepared.steps)

            fly_graph(prepared, namespace=namespace, on_step=step, on_line=line)
    except KeyboardInterrupt:
        if not prepared.bag.is_dir():
            raise
        raise output.Interrupted(f"interrupted; the steps flown so far are in {prepared.bag}") from None
    wall_time = clock["end"] - clock["start"]
    _conclude(prepared.bag, report, units, json, strict=strict, every=every, wall_time=wall_time)


def simulate(
    scenario: ScenarioArgument = "case1",
    changes: SetOption = None,
    units: UnitsOption = UnitSystem.metric,
    out: Annotated[Path | None, Option(help="Also save the time histories to this .npz file (SI).")] = None,
    strict: StrictOption = False,
    every: AllOption = False,
    json: JsonOption = False,
) -> None:
    """Fly a scenario in this process, without ROS, with the same numbers as the graph, bit for bit.

    Example: hsv simulate case1 --units paper
    """
    import numpy as np

    from hsv.certificate.coverage import uncovered_rates
    from hsv.cli.summary import FlightSummary, report_flight
    from hsv.control.controller import ExternalController
    from hsv.control.design import digest
    from hsv.control.design_file import find_design, read_design
    from hsv.flight.assembly import assemble_flight, blamed_on, uncovered_of
    from hsv.flight.closed_loop import fly
    from hsv.flight.flight import step_statistics
    from hsv.flight.requirement import margins, requirement_rows
    from hsv.flight.scenario import load_scenario
    from hsv.flight.side_by_side import TubeLevels
    from hsv.flight.tables import read_changes
    from hsv.model.plant import FlightStatus

    if out:
        check_target(out, "out", ".npz")
    loaded = load_scenario(scenario, read_changes(changes or ()))
    with blamed_on(loaded):
        design = read_design(find_design(loaded.design)) if loaded.design else None
    components = assemble_flight(loaded, design)
    started = time.perf_counter()
    flight = fly(components)
    wall_time = time.perf_counter() - started
    custom = components.controller
    if isinstance(custom, ExternalController) and (doubt := custom.doubt(flight.history.u_unsaturated[0])):
        output.report_line("hsv: warning", doubt, "bold yellow")
    if out:
        columns: dict[str, Any] = {"time": flight.time, **flight.history.columns()}
        with writing(out, "out"), out.open("wb") as stream:
            np.savez_compressed(stream, **columns)
    ended = flight.status is not FlightStatus.DIVERGED
    levels = TubeLevels(components)
    found = margins(loaded.requirement, flight, ended=ended, levels=lambda: levels.along(flight))
    disk_margin = None
    if loaded.disk_margin is not None:
        from hsv.flight.margins import margin_verdict

        disk_margin = margin_verdict(loaded, design)
    flown = FlightSummary(
        loaded,
        flight.metrics,
        flight.missing,
        fingerprint=flight.fingerprint,
        design_hash=design.digest if design else digest({}),
        ending="finished" if ended else "diverged",
        simulated_time=float(flight.time[-1]),
        wall_time=wall_time,
        not_covered=[*uncovered_of(loaded, design), *uncovered_rates(design, flight.history.state)],
        disk_margin=disk_margin,
        step_times={
            "period_ms": 1e3 * flight.period,
            "nodes": {name: step_statistics(times) for name, times in flight.law_times.items()},
            "loop_mean_ms": 1e3 * wall_time / len(flight.time),
        },
        requirements=requirement_rows(loaded.requirement, found, flight.time),
    )
    report_flight(flown, units, json, strict, every)


@_with_options
def prepare(
    flight: GraphFlight,
    folder: Annotated[Path | None, Option(help="Folder for the parameter files; default: temporary.")] = None,
    json: JsonOption = False,
) -> None:
    """Prepare a flight for another launcher: check the scenario, create the bag, write the parameter files.

    The nodes to start and their parameter files are printed. After the flight, the launcher must remove the folder of
    these files and call hsv conclude; hsv run does both by itself.

    Example: hsv prepare case1 --json
    """
    import shutil
    import tempfile

    from hsv.bags.description import LANDED, LIVE, ROOT, checked_namespace, graph
    from hsv.graph.launcher import claim_graph

    if folder:
        check_folder(folder, "folder")
    namespace = checked_namespace(flight.namespace)
    # The claim is released at once: each node claims what it publishes when it starts.
    claim_graph(graph(), namespace).close()
    target = folder or Path(tempfile.mkdtemp(prefix="hsv_run_"))
    try:
        prepared = flight.prepared(target)
    except BaseException:
        if not folder:
            shutil.rmtree(target)
        raise
    nodes = prepared.nodes
    if json:
        output.print_json(
            {
                "scenario": prepared.scenario.name,
                "bag": str(prepared.bag),
                "namespace": namespace,
                "folder": str(target),
                "parameter_files": [str(path) for path in prepared.parameter_files],
                "nodes": [
                    {name: getattr(node, name) for name in ("name", "package", "executable")}
                    | {"ends_run": node is nodes[-1], "in_flight": node is not LIVE}
                    for node in nodes
                ],
                "landed_exit_codes": LANDED,
                "last_step": prepared.steps,
            }
        )
        return
    words = " ".join(f"--params-file {path}" for path in prepared.parameter_files)
    words += f" -r __ns:={namespace}" if namespace != ROOT else ""
    output.say(
        *(f"ros2 run {node.package} {node.executable} --ros-args {words}" for node in nodes), f"bag {prepared.bag}"
    )


def conclude(
    bag: BagArgument,
    report: ReportOption = True,
    failure: Annotated[str, Option(help="Error message of a process that failed.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Conclude a flight whose nodes have exited: close its bag, print summary and verdict, and write the report.

    Launch files call this after the nodes, and hsv prepare before them; hsv run does both by itself.

    Example: hsv conclude bags/case1_20260101T000000Z
    """
    from hsv.graph.flight import close_bag

    close_bag(bag, [failure] if failure else [])
    _conclude(bag, report, units, json)


def _conclude(
    bag: Path,
    report: bool,
    units: UnitSystem,
    json: bool,
    *,
    strict: bool = False,
    every: bool = False,
    wall_time: float | None = None,
) -> None:
    """Print the summary of the flight in a closed ``bag``; with ``report``, write its report into the bag's folder."""
    from hsv.bags.flight import flight_data
    from hsv.bags.info import describe
    from hsv.bags.reader import Bag
    from hsv.cli.summary import FlightSummary, report_flight
    from hsv.flight.scenario import parse_scenario

    recorded = Bag(bag)
    if "scenario.toml" not in recorded.attachments:
        raise RecordingError(
            f"{bag}: has no scenario, like every bag of a graph started by hand: use hsv info and hsv report"
        )
    data = flight_data(recorded)
    files = {"bag": bag}
    unwritten = None
    if report:
        from hsv.pages.report import write_report

        page = bag / "report.html"
        try:
            write_report([recorded], page, units=units)
            files["report"] = page
        except RecordingError as error:
            unwritten = error  # raised after the summary, because the flight itself is complete
    description = describe(recorded)
    flown = FlightSummary(
        parse_scenario(recorded.text("scenario.toml"), recorded.custom_data.get("scenario", "")),
        data.metrics,
        data.missing,
        fingerprint=description["fingerprint"],
        design_hash=recorded.custom_data.get("design_hash", ""),
        ending=description["ending"],
        simulated_time=float(data.time[-1]),
        wall_time=wall_time,
        not_covered=description["not_covered"],
        disk_margin=description["disk_margin"],
        step_times=description["step_times"],
        requirements=description["requirements"] or (),
        files=files,
    )
    report_flight(flown, units, json, strict, every)
    if unwritten:
        raise unwritten

"""Commands that fly: one flight over DDS or in this process, campaigns, and two commands for other launchers."""

from __future__ import annotations

import shlex
import time
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option
from typer.core import TyperGroup

from hsv.base.errors import CampaignError, ParameterError, RecordingError, RunError
from hsv.base.units import UnitSystem, significant
from hsv.cli import output
from hsv.cli.options import (
    BagArgument,
    JsonOption,
    ScenarioArgument,
    TrustOption,
    UnitsOption,
    check_folder,
    check_target,
    writing,
)

if TYPE_CHECKING:
    from hsv.flight.resilience.summary import ResilienceResults

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
WorkersOption = Annotated[int, Option(help="Processes on this machine; 0: one per processor, 1: this process.")]
SchedulerOption = Annotated[str, Option(help="Address of a Dask scheduler whose workers are used instead.")]
ResultArgument = Annotated[Path, Argument(help="Result file of a campaign (.parquet).")]
FlightOption = Annotated[int, Option("--flight", help="Number of the flight.")]
PageOption = Annotated[bool, Option(help="Write a page next to the results.")]


def run(
    scenario: ScenarioArgument = "case1",
    live: LiveOption = False,
    live_port: LivePortOption = None,
    real_time_factor: RealTimeFactorOption = None,
    composed: ComposedOption = False,
    external: ExternalOption = False,
    bag: NewBagOption = None,
    namespace: NamespaceOption = "/",
    step_timeout: StepTimeoutOption = 10.0,
    paused: PausedOption = False,
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
    from hsv.graph.preparation import RunOptions, prepare

    namespace = checked_namespace(namespace)
    port = _live_port(live, live_port)
    options = RunOptions(real_time_factor, step_timeout, composed, external, port, paused)
    prepared = prepare(scenario, options, bag=bag)
    clock: dict[str, float] = {}

    def line(node: str, text: str) -> None:
        # The user needs the addresses of the live view even without --verbose.
        if verbose or WARNING in text or (node == LIVE.label and text.startswith("live ")):
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

    from hsv.cli.summary import FlightSummary, report_flight
    from hsv.control.design import digest
    from hsv.control.design_file import find_design, read_design
    from hsv.flight.assembly import assemble_flight, blamed_on, uncovered_of
    from hsv.flight.closed_loop import fly
    from hsv.flight.flight import step_statistics
    from hsv.flight.scenario import load_scenario
    from hsv.model.plant import FlightStatus

    if out:
        check_target(out, "out", ".npz")
    loaded = load_scenario(scenario)
    with blamed_on(loaded):
        design = read_design(find_design(loaded.design)) if loaded.design else None
    components = assemble_flight(loaded, design)
    started = time.perf_counter()
    flight = fly(components)
    wall_time = time.perf_counter() - started
    if out:
        columns: dict[str, Any] = {"time": flight.time, **flight.history.columns()}
        with writing(out, "out"), out.open("wb") as stream:
            np.savez_compressed(stream, **columns)
    flown = FlightSummary(
        loaded,
        flight.metrics,
        fingerprint=flight.fingerprint,
        design_hash=design.digest if design else digest({}),
        ending="diverged" if flight.status is FlightStatus.DIVERGED else "finished",
        simulated_time=float(flight.time[-1]),
        wall_time=wall_time,
        not_covered=uncovered_of(loaded, design),
        step_times={
            "period_ms": 1e3 * flight.period,
            "nodes": {name: step_statistics(times) for name, times in flight.law_times.items()},
            "loop_mean_ms": 1e3 * wall_time / len(flight.time),
        },
    )
    report_flight(flown, units, json, strict, every)


def prepare(
    scenario: ScenarioArgument = "case1",
    live: LiveOption = False,
    live_port: LivePortOption = None,
    real_time_factor: RealTimeFactorOption = None,
    composed: ComposedOption = False,
    external: ExternalOption = False,
    bag: NewBagOption = None,
    namespace: NamespaceOption = "/",
    step_timeout: StepTimeoutOption = 10.0,
    paused: PausedOption = False,
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
    from hsv.graph.preparation import RunOptions
    from hsv.graph.preparation import prepare as prepare_run

    if folder:
        check_folder(folder, "folder")
    namespace, port = checked_namespace(namespace), _live_port(live, live_port)
    options = RunOptions(real_time_factor, step_timeout, composed, external, port, paused)
    # The claim is released at once: each node claims what it publishes when it starts.
    claim_graph(graph(), namespace).close()
    target = folder or Path(tempfile.mkdtemp(prefix="hsv_run_"))
    try:
        prepared = prepare_run(scenario, options, bag=bag, folder=target)
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


def _live_port(live: bool, port: int | None) -> int | None:
    if port is not None and not live:
        raise ParameterError(f"live-port = {port}: expected with --live only")
    return (8765 if port is None else port) if live else None


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
    from hsv.pages.report import write_report

    recorded = Bag(bag)
    if "scenario.toml" not in recorded.attachments:
        raise RecordingError(
            f"{bag}: has no scenario, like every bag of a graph started by hand: use hsv info and hsv report"
        )
    data = flight_data(recorded)
    files = {"bag": bag}
    unwritten = None
    if report:
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
        fingerprint=description["fingerprint"],
        design_hash=recorded.custom_data.get("design_hash", ""),
        ending=description["ending"],
        simulated_time=float(data.time[-1]),
        wall_time=wall_time,
        not_covered=description["not_covered"],
        step_times=description["step_times"],
        files=files,
    )
    report_flight(flown, units, json, strict, every)
    if unwritten:
        raise unwritten


class _FlyByDefault(TyperGroup):
    """A group of commands that runs ``fly`` unless the first word is one of its commands or a help option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["fly", *args]
        return super().parse_args(ctx, args)


class Sampling(StrEnum):
    """Sampling methods."""

    uniform = "uniform"
    latin_hypercube = "latin_hypercube"
    sobol = "sobol"


_SAMPLES = 1000
"""Default number of flights of a campaign."""

montecarlo = typer.Typer(
    cls=_FlyByDefault,
    no_args_is_help=True,
    help="""Fly a scenario many times with uncertain parameters; each flight can be repeated alone, bit for bit.

    The word fly can be omitted: hsv montecarlo case1 is the same as hsv montecarlo fly case1.

    Example: hsv montecarlo case1 --corners""",
)


@montecarlo.command()
def fly(
    scenario: ScenarioArgument = "case1",
    samples: Annotated[int | None, Option(help=f"Number of flights; default: {_SAMPLES}.")] = None,
    seed: Annotated[int, Option(help="Determines all samples.")] = 1,
    sampling: Annotated[Sampling | None, Option(help="How samples are drawn; default: uniform.")] = None,
    corners: Annotated[bool, Option("--corners", help="Fly all combinations of extreme values.")] = False,
    scale: Annotated[float, Option(help="Factor on the parameters' bounds; 0 leaves them alone.")] = 1.0,
    factor: Annotated[
        list[str] | None, Option(help="Vary a field, e.g. 'fault[0].start=90 s..110 s'; repeatable.")
    ] = None,
    out: Annotated[Path | None, Option(help="Result file; default: campaigns/<what is flown>.parquet.")] = None,
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    restart: Annotated[bool, Option("--restart", help="Discard existing results.")] = False,
    page: PageOption = True,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Fly a campaign. After an interruption, the same command continues where it stopped.

    A flight whose controller crashes is recorded with the reason, and the campaign continues. The exit code is 1 if
    every flight crashed.

    Example: hsv montecarlo fly case1 --samples 1000 --seed 7 --factor "fault[0].start=90 s..110 s"
    """
    from hsv.cli.summary import show_campaign
    from hsv.flight.campaign.campaign import plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.campaign.store import ResultStore
    from hsv.flight.campaign.summary import Results
    from hsv.graph.preparation import commit

    for name, value in {"sampling": sampling, "samples": samples}.items():
        if corners and value is not None:
            raise CampaignError(f"{name} = {value}: expected no --{name} with --corners, which defines the flights")
    method = "corners" if corners else (sampling or Sampling.uniform).value
    factors: dict[str, tuple[object, object]] = {}
    for text in factor or ():
        field, ends = (part.strip() for part in text.partition("=")[::2])
        low, dots, high = ends.partition("..")
        if not dots:
            raise CampaignError(f"factor = {text!r}: expected FIELD=LEAST..LARGEST")
        if field in factors:
            raise CampaignError(f"factor = {text!r}: a field is given twice, expected once")
        factors[field] = low.strip(), high.strip()
    count = _SAMPLES if samples is None else samples
    campaign = plan(scenario, method=method, samples=count, seed=seed, scale=scale, commit=commit(), factors=factors)
    if out is None:
        counted = "" if corners else f"_{campaign.samples}_seed{seed}"
        out = Path("campaigns", f"{campaign.scenario_name}_{method}{counted}.parquet")
        check_folder(out.parent, "out")  # made with the first file
    else:
        check_target(out, "out", ".parquet")
    store = ResultStore(out, campaign)
    with output.resumable(store.folder) as complete:
        with (
            make_executor(workers, scheduler, output.errors.print) as flying,
            output.flights(campaign.scenario_name, campaign.samples) as progress,
        ):
            flown = run_campaign(campaign, store, flying, restart=restart, progress=progress)
            complete(out)
        # The results are trusted: their code is that of the user's own scenario.
        results = Results(out, trust=True)
        show_campaign(results, units, json, page, flown.flights)
    if flown.flights and not json:
        output.say(f"flown in {significant(flown.wall_time)} s")
    if results.crashed.all():
        raise RunError(f"all {campaign.samples} flights crashed, the first: {results.row(0)['crashed']}")


@montecarlo.command()
def summary(
    result: ResultArgument,
    page: PageOption = True,
    trust: TrustOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Show the results of a finished campaign.

    Example: hsv montecarlo summary campaigns/case1_corners.parquet --units paper
    """
    from hsv.cli.summary import show_campaign
    from hsv.flight.campaign.summary import Results

    show_campaign(Results(result, trust=trust), units, json, page)


@montecarlo.command()
def replay(
    result: ResultArgument,
    flight: FlightOption,
    over_dds: Annotated[bool, Option("--over-dds", help="Fly it with the graph of node processes.")] = False,
    bag: Annotated[Path | None, Option(help="With --over-dds: bag to write; default: bags/<flight>.")] = None,
    trust: TrustOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Repeat a single flight of a campaign, and compare all its results bit for bit.

    Example: hsv montecarlo replay campaigns/case1_corners.parquet --flight 17 --over-dds
    """
    from hsv.cli.summary import sample_words
    from hsv.flight.campaign.sample_runner import OUTCOMES
    from hsv.flight.campaign.summary import Results
    from hsv.flight.metrics import is_share
    from hsv.graph.campaign_replay import replay_in_process, replay_over_dds

    if bag and not over_dds:
        raise CampaignError(f"bag = {str(bag)!r}: expected with --over-dds only")
    results = Results(result, trust=trust)
    if over_dds:
        target = bag or Path("bags", f"{result.stem}_flight_{flight}")
        with output.stages() as bar:
            replayed = replay_over_dds(results, flight, target, lambda step, steps: bar("over DDS", step, steps))
    else:
        replayed = replay_in_process(results, flight)
    outcome, differing, sample = replayed.repeated, replayed.differing, results.sample(flight)
    quantities = {name: (float(v), unit) for name, unit in OUTCOMES.items() if (v := outcome.get(name)) is not None}
    if json:
        output.print_json(
            {
                "flight": flight,
                "identical": not differing,
                "differing": differing,
                "diverged": outcome["diverged"],
                "crashed": outcome["crashed"],
                "sample_si": sample,
                "outcome": output.to_json(quantities, units),
                "fingerprint": outcome.get("fingerprint"),
                "bag": str(replayed.bag) if replayed.bag else None,
            }
        )
    else:
        shares = [*filter(is_share, quantities)]
        output.print_table(f"flight {flight} of {result.name}", quantities, units, shares=shares)
        crashed = outcome["crashed"]
        output.say(
            f"sample  {sample_words(sample, units)}",
            f"crashed {crashed}" if crashed else f"fingerprint {outcome['fingerprint']}",
            *([f"bag     {replayed.bag}"] if replayed.bag else []),
        )
        if not differing:
            output.console.print("identical to the campaign's flight in every bit", style="green")
    if differing:
        name = differing[0]
        raise RunError(
            f"flight {flight}: {name} is {outcome.get(name)!r}, the campaign recorded "
            f"{replayed.recorded[name]!r} ({len(differing)} outcomes differ)"
        )


@montecarlo.command()
def scenario(
    result: ResultArgument,
    flight: FlightOption,
    design: Annotated[Path | None, Option(help="Also write the flown design to this .yaml file.")] = None,
    trust: TrustOption = False,
) -> None:
    """Print the scenario of a single flight of a campaign; flown by itself it has the same fingerprint.

    Example: hsv montecarlo scenario campaigns/case1_corners.parquet --flight 17 > worst.toml
    """
    from hsv.bags.parameter_sections import ParameterSections
    from hsv.flight.campaign.summary import Results
    from hsv.graph.campaign_replay import require_design
    from hsv.plugins.library import seen_from

    results = Results(result, trust=trust)
    if design is None:
        require_design(results)
    else:
        check_target(design, "design", ".yaml")
    named = {"controller": seen_from(results.campaign.scenario.controller, Path())}
    text = results.file(flight, **named, **({"design": str(design)} if design else {}))
    if design:
        with writing(design, "design"):
            design.write_text(ParameterSections(dict(results.campaign.design)).to_yaml(), encoding="utf-8")
    print(text, end="")


def resilience(
    controllers: Annotated[str, Option(help="Scenarios, separated by commas; default: Tube-MPC, robust MPC.")] = "",
    faults: Annotated[str, Option(help="Faults (see --list) or their types, with commas between; default: all.")] = "",
    out: Annotated[Path, Option(help="Folder for report, worst flights, results.")] = Path("resilience"),
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    listed: Annotated[bool, Option("--list", help="List the faults with their severities and exit.")] = False,
    json: JsonOption = False,
) -> None:
    """Fly controllers with faults of three severities, find the severest that each survives, and make a map of it.

    After an interruption, the same command continues where it stopped; controllers and faults can be added later. The
    exit code is 1 if every flight crashed.

    Example: hsv resilience --controllers case1,case1_rmpc --faults elevator_loss,elevator_delay
    """
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.resilience.campaign import CONTROLLERS, plan
    from hsv.flight.resilience.faults import TRIED
    from hsv.flight.resilience.summary import CaseStore, ResilienceResults, parameter_words
    from hsv.pages.resilience import write_results

    if listed:
        output.print_titles({name: parameter_words(name) for name in TRIED}, json)
        return
    scenarios, kinds = ([name.strip() for name in text.split(",") if text] for text in (controllers, faults))
    # A type of hsv list faults stands for all faults of this type.
    tried = [[fault for fault, each in TRIED.items() if each.kind == kind] or [kind] for kind in kinds]
    campaign = plan(scenarios or CONTROLLERS, tuple(dict.fromkeys(chain.from_iterable(tried))) or tuple(TRIED))
    check_folder(out, "out")
    store = CaseStore(out, campaign)
    with output.resumable(store.folder) as complete:
        with (
            make_executor(workers, scheduler, output.errors.print) as flying,
            output.flights("resilience", sum(case.flights for case in campaign.batches)) as progress,
        ):
            flown = run_campaign(campaign, store, flying, progress=progress)
            complete(store.folder)
        results = ResilienceResults.read(campaign, store)
        options = [word for pair in (("--controllers", controllers), ("--faults", faults)) if pair[1] for word in pair]
        written = write_results(results, out, shlex.join(["hsv", "resilience", *options]))
    if json:
        values = {"cases_flown_now": flown.batches, "flown_in_s": flown.wall_time}
        output.print_json({"written": list(map(str, written)), **values, "cells": _cells(results)})
    else:
        names = [subject.name for subject in results.campaign.subjects]
        rows = results.campaign.faults
        cells = [["{} of {}".format(*results.squares[fault, name].survived) for name in names] for fault in rows]
        output.print_matrix("flights survived", [fault.replace("_", " ") for fault in rows], names, cells)
        if flown.batches:
            output.say(f"flown in {flown.wall_time:.0f} s")
        output.say(f"written {', '.join(map(str, written))}")
    crashes = [flight.crashed for flight in results.flights]
    if all(crashes):
        raise RunError(f"all {len(crashes)} flights crashed, the first: {crashes[0]}")


def _cells(results: ResilienceResults) -> list[dict[str, Any]]:
    from hsv.flight.resilience.faults import TRIED
    from hsv.pages.resilience import flight_file

    found = []
    for (fault, controller), square in results.squares.items():
        tried = TRIED[fault]
        for moment, cells in square.cells.items():
            ends = square.boundaries[moment]
            found += [
                {
                    "controller": controller,
                    "fault": fault,
                    "time": moment.name,
                    "severity": cell.severity,
                    "value": cell.flights[0].value,
                    "unit": tried.unit,
                    "survived": cell.survived,
                    "flights": len(cell.flights),
                    "attitude_rad": cell.attitude,
                    "altitude_m": cell.altitude,
                    "recovery_time_s": cell.recovery_time,
                    "time_to_loss_s": cell.time_to_loss,
                    "worst_flight": flight_file(cell),
                    "largest_survived": None if ends.survived is None else tried.value(ends.survived),
                    "least_lost": None if ends.lost is None else tried.value(ends.lost),
                }
                for cell in cells
            ]
    return found

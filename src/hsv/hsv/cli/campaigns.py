"""Commands that fly many times: campaigns, the flights of a campaign one by one, and resilience."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from hsv.base.errors import CampaignError, RunError
from hsv.base.units import UnitSystem, significant
from hsv.cli import output
from hsv.cli.options import (
    Group,
    JsonOption,
    ScenarioArgument,
    SetOption,
    TrustOption,
    UnitsOption,
    check_folder,
    check_target,
    writing,
)

if TYPE_CHECKING:
    from hsv.flight.resilience.summary import ResilienceResults

WorkersOption = Annotated[int, Option(help="Processes on this machine; 0: one per processor, 1: this process.")]
SchedulerOption = Annotated[str, Option(help="Address of a Dask scheduler whose workers are used instead.")]
ResultArgument = Annotated[Path, Argument(help="Result file of a campaign (.parquet).")]
FlightOption = Annotated[int, Option("--flight", help="Number of the flight.")]
ScaleOption = Annotated[float, Option(help="Factor on the parameters' bounds; 0 leaves them alone.")]
FactorOption = Annotated[
    list[str] | None, Option(help="Vary a field: 'FIELD=90 s..110 s', or a grid, FIELD=0.9,0.8,0.7.")
]
RestartOption = Annotated[bool, Option("--restart", help="Discard existing results.")]
PageOption = Annotated[bool, Option(help="Write a page next to the results.")]


class _FlyByDefault(Group):
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
    samples: Annotated[int | None, Option(help=f"Flights, for each point of a grid; default: {_SAMPLES}.")] = None,
    seed: Annotated[int, Option(help="Determines all samples.")] = 1,
    sampling: Annotated[
        Sampling | None, Option(help=f"{', '.join(Sampling)}; default: uniform.", metavar="METHOD")
    ] = None,
    corners: Annotated[bool, Option("--corners", help="Fly all combinations of extreme values.")] = False,
    scale: ScaleOption = 1.0,
    factor: FactorOption = None,
    changes: SetOption = None,
    out: Annotated[Path | None, Option(help="Result file; default: campaigns/<scenario>_<method>.parquet.")] = None,
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    restart: RestartOption = False,
    page: PageOption = True,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Fly a campaign. After an interruption, the same command continues where it stopped.

    A flight whose controller crashes is recorded with the reason, and the campaign continues. The exit code is 1 if
    every flight crashed.

    With a grid, the same vehicles with the same noise fly at each of its points.

    Example: hsv montecarlo fly case1 --samples 100 --factor "fault[0].effectiveness=0.9,0.8,0.7"
    """
    from hsv.cli.summary import show_campaign
    from hsv.flight.campaign.campaign import plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.campaign.store import ResultStore
    from hsv.flight.campaign.summary import Results
    from hsv.flight.tables import read_changes
    from hsv.graph.preparation import commit

    for name, value in {"sampling": sampling, "samples": samples}.items():
        if corners and value is not None:
            raise CampaignError(f"{name} = {value}: expected no --{name} with --corners, which defines the flights")
    method = "corners" if corners else (sampling or Sampling.uniform).value
    factors = read_factors(factor or ())
    count = _SAMPLES if samples is None else samples
    changed = read_changes(changes or ())
    campaign = plan(scenario, method=method, samples=count, seed=seed, scale=scale, factors=factors, changes=changed)
    campaign = replace(campaign, commit=commit())
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


def read_factors(texts: Sequence[str]) -> dict[str, Sequence[object]]:
    """Return a pair of least and largest value, or a list of grid values, by field, from the texts of ``--factor``."""
    factors: dict[str, Sequence[object]] = {}
    for text in texts:
        field, values = (part.strip() for part in text.partition("=")[::2])
        low, dots, high = values.partition("..")
        if not dots and "," not in values:
            raise CampaignError(f"factor = {text!r}: expected FIELD=LEAST..LARGEST or FIELD=VALUE,VALUE,...")
        if field in factors:
            raise CampaignError(f"factor = {text!r}: a field is given twice, expected once")
        factors[field] = (low.strip(), high.strip()) if dots else [value.strip() for value in values.split(",")]
    return factors


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
    from hsv.flight.campaign.sample_runner import outcomes_of
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
    known = outcomes_of(results.campaign.scenario)
    quantities = {name: (float(v), unit) for name, unit in known.items() if (v := outcome.get(name)) is not None}
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
            f"sample  {sample_words(results.campaign.factors, sample, units)}",
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
    from hsv.flight.resilience.summary import CaseStore, ResilienceResults, survived
    from hsv.pages.resilience import write_results

    if listed:
        output.print_titles({name: fault.words for name, fault in TRIED.items()}, json)
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
        folder = "" if out == Path("resilience") else str(out)
        given = {"--controllers": controllers, "--faults": faults, "--out": folder}
        options = [word for pair in given.items() if pair[1] for word in pair]
        written = write_results(results, out, shlex.join(["hsv", "resilience", *options]))
    if json:
        values = {"cases_flown_now": flown.batches, "flown_in_s": flown.wall_time}
        output.print_json({"written": list(map(str, written)), **values, "cells": _cells(results)})
    else:
        names = [subject.name for subject in results.campaign.subjects]
        rows = results.campaign.faults
        cells = [["{} of {}".format(*survived(results.squares[fault, name].every)) for name in names] for fault in rows]
        output.print_matrix("flights survived", [fault.replace("_", " ") for fault in rows], names, cells)
        if flown.batches:
            output.say(f"flown in {flown.wall_time:.0f} s")
        output.say(f"written {', '.join(map(str, written))}")
    crashes = [flight.crashed for cell in results.cells for flight in cell.flights]
    if all(crashes):
        raise RunError(f"all {len(crashes)} flights crashed, the first: {crashes[0]}")


def _cells(results: ResilienceResults) -> list[dict[str, Any]]:
    from hsv.flight.resilience.faults import TRIED
    from hsv.pages.resilience import flight_file

    found = []
    for cell in results.cells:
        case, tried = cell.case, TRIED[cell.case.fault]
        ends = results.squares[case.fault, case.subject.name].boundaries[case.moment]
        found.append(
            {
                "controller": case.subject.name,
                "fault": case.fault,
                "time": case.moment.name,
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
        )
    return found

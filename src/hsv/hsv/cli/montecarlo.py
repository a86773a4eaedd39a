"""The command ``hsv montecarlo``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from hsv.base.units import UnitSystem, significant
from hsv.cli.options import JsonOption, ScenarioArgument, SchedulerOption, TrustOption, UnitsOption, WorkersOption
from hsv.cli.output import console, errors, print_json, resumable, to_json
from hsv.cli.targets import check_target


class _FlyByDefault(TyperGroup):
    """Takes a first word that is no command of the group for the scenario to fly."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *ctx.help_option_names):
            args = ["fly", *args]
        return super().parse_args(ctx, args)


_SAMPLES = 1000
"""Flights of a campaign that says no number."""


class Sampling(StrEnum):
    """Sampling methods."""

    uniform = "uniform"
    latin_hypercube = "latin_hypercube"
    sobol = "sobol"


montecarlo = typer.Typer(
    cls=_FlyByDefault,
    no_args_is_help=True,
    help="""Fly a scenario many times with uncertain parameters; each flight can be repeated alone, bit for bit.

    The word fly can be omitted: hsv montecarlo case1 is the same as hsv montecarlo fly case1.

    Example: hsv montecarlo case1 --corners""",
)

ResultArgument = Annotated[Path, typer.Argument(help="Result file of a campaign (.parquet).")]


@montecarlo.command()
def fly(
    scenario: ScenarioArgument = "case1",
    samples: Annotated[int | None, typer.Option(help=f"Number of flights; default: {_SAMPLES}.")] = None,
    seed: Annotated[int, typer.Option(help="Determines all samples.")] = 1,
    sampling: Annotated[Sampling | None, typer.Option(help="How samples are drawn; default: uniform.")] = None,
    corners: Annotated[
        bool, typer.Option("--corners", help="Fly all combinations of smallest and largest values.")
    ] = False,
    scale: Annotated[float, typer.Option(help="Factor on the parameters' bounds; 0 leaves them alone.")] = 1.0,
    factor: Annotated[
        list[str] | None,
        typer.Option(help="Vary a field of the scenario, FIELD=LEAST..LARGEST, e.g. 'fault[0].start=90 s..110 s'."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Result file; default: campaigns/<what is flown>.parquet.")] = None,
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    restart: Annotated[
        bool, typer.Option("--restart", help="Discard existing results and start from the beginning.")
    ] = False,
    page: Annotated[bool, typer.Option(help="Write the page of the results beside them.")] = True,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Fly a campaign. After an interruption, the same command continues where it stopped.

    A flight whose controller crashes is recorded with the reason, and the campaign continues. The exit code is 1 if
    every flight crashed.

    Example: hsv montecarlo fly case1 --samples 1000 --seed 7 --factor "fault[0].start=90 s..110 s"
    """
    import time

    from hsv.base.errors import CampaignError, RunError
    from hsv.cli.campaign_summary import announce, show
    from hsv.cli.progress import flights as flights_bar
    from hsv.flight.campaign.campaign import plan
    from hsv.flight.campaign.capacity import Capacity
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.run import run_campaign
    from hsv.flight.campaign.store import ResultStore
    from hsv.flight.campaign.summary import Results
    from hsv.graph.preparation import commit

    given = {"sampling": sampling, "samples": samples}
    for name, value in given.items():
        if corners and value is not None:
            raise CampaignError(f"{name} = {value}: expected no --{name} with --corners, which defines the flights")
    method = "corners" if corners else (sampling or Sampling.uniform).value
    factors = dict(map(_factor, factor or ()))
    count = _SAMPLES if samples is None else samples
    campaign = plan(scenario, method=method, samples=count, seed=seed, scale=scale, commit=commit(), factors=factors)
    if out is None:
        Path("campaigns").mkdir(exist_ok=True)
        counted = "" if corners else f"_{campaign.samples}_seed{seed}"
        out = Path("campaigns", f"{campaign.scenario_name}_{method}{counted}.parquet")
    if out.suffix != ".parquet":
        raise CampaignError(f"out = {str(out)!r}: expected a file that ends in .parquet")
    check_target(out, "out")
    store = ResultStore(out, campaign)
    begun: dict[str, float] = {}

    def expect(needed: Capacity) -> None:
        announce(needed)
        begun["expected"] = needed.wall_time

    with (
        resumable(store.folder),
        make_executor(workers, scheduler, lambda: errors.print("waiting for the scheduler's workers")) as flying,
        flights_bar(campaign.scenario_name, campaign.samples) as shown,
    ):

        def progress(done: int) -> None:
            begun.setdefault("at", time.perf_counter())
            shown(done)

        flown = run_campaign(campaign, store, flying, restart=restart, expect=expect, progress=progress)
        taken = time.perf_counter() - begun.get("at", time.perf_counter())
    # The campaign in the file is the one that was asked for: its code is that of the user's own scenario.
    results = Results(out, trust=True)
    show(results, units, json, page, flown)
    if flown and not json:
        console.print(f"flown in {significant(taken)} s, expected: {significant(begun['expected'])} s")
    if results.crashed.all():
        raise RunError(f"all {campaign.samples} flights crashed, the first: {results.row(0)['crashed']}")


@montecarlo.command()
def summary(
    result: ResultArgument,
    page: Annotated[bool, typer.Option(help="Write the page of the results beside them.")] = True,
    trust: TrustOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Show the results of a finished campaign.

    Example: hsv montecarlo summary campaigns/case1_corners.parquet --units paper
    """
    from hsv.cli.campaign_summary import show
    from hsv.flight.campaign.summary import Results

    show(Results(result, trust=trust), units, json, page)


@montecarlo.command()
def replay(
    result: ResultArgument,
    flight: Annotated[int, typer.Option(help="Number of the flight.")],
    over_dds: Annotated[bool, typer.Option("--over-dds", help="Fly it with the graph of node processes.")] = False,
    bag: Annotated[Path | None, typer.Option(help="With --over-dds: bag to write; default: bags/<flight>.")] = None,
    trust: TrustOption = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Repeat a single flight of a campaign, and compare all its results bit for bit.

    Example: hsv montecarlo replay campaigns/case1_corners.parquet --flight 17 --over-dds
    """
    from hsv.base.errors import CampaignError, RunError
    from hsv.cli.campaign_summary import sample_words
    from hsv.cli.output import print_table
    from hsv.cli.progress import stages
    from hsv.flight.campaign.summary import Results
    from hsv.flight.campaign.table import OUTCOMES
    from hsv.graph.campaign_replay import replay_in_process, replay_over_dds

    if bag and not over_dds:
        raise CampaignError(f"bag = {str(bag)!r}: expected with --over-dds only")
    results = Results(result, trust=trust)
    if over_dds:
        target = bag or Path("bags", f"{result.stem}_flight_{flight}")
        with stages() as bar:
            repeated = replay_over_dds(results, flight, target, lambda step, steps: bar("over DDS", step, steps))
    else:
        repeated = replay_in_process(results, flight)
    sample = results.sample(flight)
    quantities = {
        name: (float(value), unit)
        for name, unit in OUTCOMES.items()
        if (value := repeated.repeated.get(name)) is not None
    }
    differing = repeated.differing
    if json:
        print_json(
            {
                "flight": flight,
                "identical": not differing,
                "differing": differing,
                "diverged": repeated.repeated["diverged"],
                "crashed": repeated.repeated["crashed"],
                "sample_si": sample,
                "outcome": to_json(quantities, units),
                "fingerprint": repeated.repeated.get("fingerprint"),
                "bag": str(repeated.bag) if repeated.bag else None,
            }
        )
    else:
        print_table(f"flight {flight} of {result.name}", quantities, units)
        console.print("sample  " + sample_words(sample, units), soft_wrap=True)
        if crashed := repeated.repeated["crashed"]:
            console.print(f"crashed {crashed}", soft_wrap=True, markup=False)
        else:
            console.print(f"fingerprint {repeated.repeated['fingerprint']}", soft_wrap=True)
        if repeated.bag:
            console.print(f"bag     {repeated.bag}", soft_wrap=True)
        if not differing:
            console.print("identical to the campaign's flight in every bit", style="green")
    if differing:
        name = differing[0]
        raise RunError(
            f"flight {flight}: {name} is {repeated.repeated.get(name)!r}, the campaign recorded "
            f"{repeated.recorded[name]!r} ({len(differing)} outcomes differ)"
        )


@montecarlo.command()
def scenario(
    result: ResultArgument,
    flight: Annotated[int, typer.Option(help="Number of the flight.")],
    design: Annotated[
        Path | None, typer.Option(help="Also write the design that was flown to this file (.yaml), and refer to it.")
    ] = None,
    trust: TrustOption = False,
) -> None:
    """Print the scenario of a single flight of a campaign; flown by itself it has the same fingerprint.

    Example: hsv montecarlo scenario campaigns/case1_corners.parquet --flight 17 > worst.toml
    """
    from hsv.bags.parameter_sections import ParameterSections
    from hsv.base.errors import CampaignError
    from hsv.cli.targets import writing
    from hsv.control.library import seen_from
    from hsv.flight.campaign.summary import Results
    from hsv.graph.campaign_replay import require_design

    results = Results(result, trust=trust)
    if design is None:
        require_design(results)
    elif design.suffix != ".yaml":
        raise CampaignError(f"design = {str(design)!r}: expected a file that ends in .yaml")
    named = {"controller": seen_from(results.campaign.scenario.controller, Path())}
    text = results.file(flight, **named, **({"design": str(design)} if design else {}))
    if design:
        check_target(design, "design")
        with writing(design, "design"):
            design.write_text(ParameterSections(dict(results.campaign.design)).to_yaml(), encoding="utf-8")
    print(text, end="")


def _factor(text: str) -> tuple[str, tuple[str, str]]:
    """Return field, least and largest value of a factor as it is given."""
    from hsv.base.errors import CampaignError

    field, _, ends = text.partition("=")
    low, dots, high = ends.partition("..")
    if not dots:
        raise CampaignError(f"factor = {text!r}: expected FIELD=LEAST..LARGEST")
    return field.strip(), (low.strip(), high.strip())

"""Commands that search among the flights of a scenario: the worst flight, and the probability of a rare failure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Option

from hsv.base.errors import CampaignError, RunError
from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.campaigns import (
    FactorOption,
    PageOption,
    RestartOption,
    ScaleOption,
    SchedulerOption,
    WorkersOption,
    read_factors,
)
from hsv.cli.options import JsonOption, ScenarioArgument, SetOption, UnitsOption, check_folder, check_target, writing

if TYPE_CHECKING:
    from hsv.flight.campaign.campaign import Campaign
    from hsv.flight.campaign.summary import Results
    from hsv.flight.search.worst import Worst

Search = Callable[[Any, Any], Any]
Texts = list[str] | None

SeedOption = Annotated[int, Option(help="Determines all random samples.")]
OutOption = Annotated[Path | None, Option(help="Result file; default: campaigns/<scenario>_<command>_<goal>.parquet.")]


def worst(
    scenario: ScenarioArgument = "case1",
    goal: Annotated[str, Option("--of", help="Requirement or metric; default: all requirements.")] = "",
    budget: Annotated[int, Option(help="Largest number of flights.")] = 400,
    seed: SeedOption = 1,
    scale: ScaleOption = 1.0,
    factor: FactorOption = None,
    changes: SetOption = None,
    out: OutOption = None,
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    restart: RestartOption = False,
    page: PageOption = True,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Find the worst flight within the bounds of a scenario, and write it as a scenario that flies alone.

    The flight with the smallest margin of a requirement, or with the largest magnitude of a metric, over everything
    that hsv montecarlo would vary. After an interruption, the same command continues where it stopped.

    Example: hsv worst case1 --of post_fault_attitude_from_nominal --factor "fault[0].start=0.5 s..150 s"
    """
    from hsv.flight.campaign.campaign import WORST
    from hsv.flight.search.worst import least_budget, of_campaign

    campaign = _planned(WORST, scenario, goal, budget, seed, scale, factor, changes)
    if budget < (least := least_budget(campaign.factors)):
        raise CampaignError(f"budget = {budget}: expected at least {least} flights for {len(campaign.factors)} factors")
    with _searched(campaign, of_campaign, out, workers, scheduler, restart) as (found, results, flown):
        _show_worst(found, results, units, json, page, flown)


def _show_worst(found: Worst, results: Results, units: UnitSystem, json: bool, page: bool, flown: int) -> None:
    """Print the result of a search, write the worst flight as a scenario and, with ``page``, the page."""
    from hsv.cli.summary import sample_words
    from hsv.pages.search import in_words

    campaign, row, sample = results.campaign, results.row(found.flight), results.sample(found.flight)
    alone = results.path.with_suffix(".toml")
    with writing(alone, "out"):
        alone.write_text(results.file(found.flight), encoding="utf-8")
    files = {"scenario": str(alone)} | _written(results, page)
    if json:
        output.print_json(
            files
            | {
                "goal": campaign.goal,
                "flights": found.flights,
                "flown_now": flown,
                "worst": {
                    "flight": found.flight,
                    "badness_si": found.badness,
                    "sample_si": sample,
                    "fingerprint": row["fingerprint"],
                },
                "broken": found.broken(campaign.goal),
                "nominal_si": found.nominal,
                "random": {"flights": found.random_flights, "badness_si": found.random},
                "phases": [phase._asdict() for phase in found.phases],
                "influences_si": found.influences,
            }
        )
        return
    shown = [(phase.name, phase.flights, in_words(campaign, phase.worst, units)) for phase in found.phases]
    output.print_rows([{"search": name, "flights": flights, "worst so far": at} for name, flights, at in shown])
    at, nominal, drawn = (in_words(campaign, bad, units) for bad in (found.badness, found.nominal, found.random))
    output.say(f"worst of {found.flights} flights: number {found.flight}, {at} (nominal: {nominal})")
    if found.random_flights:
        output.say(f"worst of {found.random_flights} random flights: {drawn}")
    mattered = [f"{name} {in_words(campaign, gain, units, change=True)}" for name, gain in found.influences.items()]
    less = [f"less bad if one moves to its other end, by: {', '.join(mattered)}"] if mattered else []
    output.say(
        output.folded(f"sample: {sample_words(campaign.factors, sample, units)}", 2),
        *(output.folded(line, 2) for line in less),
        f"crashed     {row['crashed']}" if row["crashed"] else f"fingerprint {row['fingerprint']}",
        *(f"{name:11} {file}" for name, file in files.items()),
    )


def rare(
    scenario: ScenarioArgument = "case1",
    goal: Annotated[str, Option("--of", help="Requirement; default: all requirements of the scenario.")] = "",
    budget: Annotated[int, Option(help="Largest number of flights, at least 5500.")] = 20_000,
    seed: SeedOption = 1,
    scale: ScaleOption = 1.0,
    factor: FactorOption = None,
    changes: SetOption = None,
    out: OutOption = None,
    workers: WorkersOption = 0,
    scheduler: SchedulerOption = "",
    restart: RestartOption = False,
    page: PageOption = True,
    json: JsonOption = False,
) -> None:
    """Estimate the probability that a requirement breaks, with an interval from independent runs.

    The method is subset simulation, or plain sampling if it is cheaper. The exit code is 1 if there is no interval,
    because some runs did not reach a failure within the budget. After an interruption, the same command continues.

    Example: hsv rare mine.toml --of "attitude after the fault" --budget 20000
    """
    from hsv.flight.campaign.campaign import RARE
    from hsv.flight.campaign.summary import CONFIDENCE
    from hsv.flight.search.rare import LEAST_BUDGET, RUNS, of_campaign

    campaign = _planned(RARE, scenario, goal, budget, seed, scale, factor, changes)
    if budget < LEAST_BUDGET:
        raise CampaignError(f"budget = {budget}: expected at least {LEAST_BUDGET} flights, for independent runs")
    with _searched(campaign, of_campaign, out, workers, scheduler, restart) as (found, results, flown):
        files = _written(results, page)
        if json:
            given = {"goal": campaign.goal, "confidence": CONFIDENCE, "flown_now": flown}
            output.print_json(files | given | asdict(found))
        else:
            shown = " to ".join(f"{end:.3g}" for end in found.interval) if found.interval else "not measured"
            output.say(f"probability {found.probability:.3g}, 95 % interval {shown}")
            if found.runs:
                output.say(f"runs        {', '.join(f'{p:.2g}' for p in found.runs)}; at most {found.levels} levels")
            output.say(
                f"flights     {found.samples}, {found.method}", *(f"{name:11} {file}" for name, file in files.items())
            )
            for warning in found.warnings:
                output.report_line("hsv: warning", warning, "bold yellow")
        if not found.interval:
            raise RunError(f"no interval: {len(found.runs)} of {RUNS} runs reached the failure with {budget} flights")


def _written(results: Results, page: bool) -> dict[str, str]:
    """Write the page of a search next to its ``results``, if ``page`` is true; return the paths of both by name."""
    from hsv.pages.campaign import write_campaign_page

    files = {"result": results.path} | ({"page": results.path.with_suffix(".html")} if page else {})
    if page:
        write_campaign_page(results, files["page"])
    return {name: str(path) for name, path in files.items()}


def _planned(
    method: str, scenario: str, goal: str, budget: int, seed: int, scale: float, factor: Texts, changes: Texts
) -> Campaign:
    """Return the campaign of a search; the number of its samples is known only at its end."""
    from hsv.flight.campaign.campaign import MAX_SAMPLES, RARE, plan
    from hsv.flight.search.rows import check_goal
    from hsv.flight.tables import read_changes
    from hsv.graph.preparation import commit

    if budget > MAX_SAMPLES:
        raise CampaignError(f"budget = {budget}: expected at most {MAX_SAMPLES} flights")
    factors, changed = read_factors(factor or ()), read_changes(changes or ())
    planned = plan(scenario, samples=1, seed=seed, scale=scale, factors=factors, changes=changed)
    goal = check_goal(goal, planned.scenario, margins_only=method == RARE)
    for grid in planned.grid:
        raise CampaignError(f"factor {grid.name}: a search has no grid, expected {grid.name}=LEAST..LARGEST")
    return replace(planned, method=method, commit=commit(), goal=goal, budget=budget, samples=0)


@contextmanager
def _searched(
    campaign: Campaign, search: Search, out: Path | None, workers: int, scheduler: str, restart: bool
) -> Iterator[tuple[Any, Results, int]]:
    """Fly a search; yield its result, its flights, and the number of those that were flown now."""
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.summary import Results
    from hsv.flight.search.rows import Rows, recorded

    if out:
        check_target(out, "out", ".parquet")
    else:
        check_folder(Path("campaigns"), "out")
    target = out or Path("campaigns", f"{campaign.scenario_name}_{campaign.method}_{campaign.goal}.parquet")
    with output.resumable(target.with_name(target.name + ".parts")) as complete:
        with (
            make_executor(workers, scheduler, output.errors.print) as flying,
            output.flights(campaign.scenario_name, campaign.budget) as progress,
        ):
            rows = Rows(target, campaign, flying, progress)
            rows.run(search, restart=restart)
            complete(target)
        results = Results(target, trust=True)
        yield search(results.campaign, recorded(results)), results, rows.flown_now

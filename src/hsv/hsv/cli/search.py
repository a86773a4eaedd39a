"""Commands that search among the flights of a scenario: the worst flight, and the probability of a rare failure."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

GoalOption = Annotated[str, Option("--of", help="Requirement or metric; default: all requirements of the scenario.")]
SeedOption = Annotated[int, Option(help="Determines all random samples.")]
OutOption = Annotated[Path | None, Option(help="Result file; default: campaigns/<scenario>_<command>_<goal>.parquet.")]


def worst(
    scenario: ScenarioArgument = "case1",
    goal: GoalOption = "",
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
    from hsv.flight.campaign.campaign import WORST, plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.summary import Results
    from hsv.flight.search.rows import Rows
    from hsv.flight.search.worst import find_worst, least_budget
    from hsv.flight.tables import read_changes

    changed, factors = read_changes(changes or ()), read_factors(factor or ())
    planned = plan(scenario, samples=1, seed=seed, scale=scale, factors=factors, changes=changed)
    campaign = _search(planned, WORST, goal, budget)
    least = least_budget(campaign.factors)
    if budget < least:
        raise CampaignError(f"budget = {budget}: expected at least {least} flights for {len(campaign.factors)} factors")
    target = _target(out, campaign)
    with output.resumable(target.with_name(target.name + ".parts")) as complete:
        with (
            make_executor(workers, scheduler, output.errors.print) as flying,
            output.flights(campaign.scenario_name, budget) as progress,
        ):
            rows = Rows(target, campaign, flying, progress)
            rows.run(lambda fly: find_worst(fly, campaign.factors, budget, seed), restart=restart)
            complete(target)
        _show_worst(Results(target, trust=True), units, json, page, rows.flown_now)


def _search(planned: Campaign, method: str, goal: str, budget: int) -> Campaign:
    """Return the campaign of a search; the number of its samples is known only at its end."""
    from hsv.flight.search.rows import check_goal
    from hsv.graph.preparation import commit

    goal = check_goal(goal, planned.scenario)
    for factor in planned.grid:
        raise CampaignError(f"factor {factor.name}: a search has no grid, expected {factor.name}=LEAST..LARGEST")
    return replace(planned, method=method, commit=commit(), goal=goal, budget=budget, samples=0)


def _target(out: Path | None, campaign: Campaign) -> Path:
    if out is not None:
        check_target(out, "out", ".parquet")
        return out
    target = Path("campaigns", f"{campaign.scenario_name}_{campaign.method}_{campaign.goal}.parquet")
    check_folder(target.parent, "out")
    return target


def _show_worst(results: Results, units: UnitSystem, json: bool, page: bool, flown: int) -> None:
    """Print the result of a search, write the worst flight as a scenario and, with ``page``, the page."""
    from hsv.cli.summary import sample_words
    from hsv.flight.search.worst import repeated
    from hsv.pages.campaign import write_campaign_page
    from hsv.pages.search import in_words

    found, campaign = repeated(results), results.campaign
    alone = results.path.with_suffix(".toml")
    with writing(alone, "out"):
        alone.write_text(results.file(found.flight), encoding="utf-8")
    written = results.path.with_suffix(".html") if page else None
    if written:
        write_campaign_page(results, written)
    row = results.row(found.flight)
    if json:
        output.print_json(
            {
                "result": str(results.path),
                "page": str(written) if written else None,
                "scenario_file": str(alone),
                "goal": campaign.goal,
                "flights": found.flights,
                "flown_now": flown,
                "worst": {"flight": found.flight, "badness_si": found.badness, "fingerprint": row["fingerprint"]}
                | {"sample_si": results.sample(found.flight)},
                "broken": found.broken(campaign.goal),
                "nominal_si": found.nominal,
                "random": {"flights": found.random_flights, "badness_si": found.random},
                "phases": [phase._asdict() for phase in found.phases],
                "influences_si": found.influences,
            }
        )
        return
    rows = [(phase.name, str(phase.flights), in_words(campaign, phase.worst, units)) for phase in found.phases]
    output.print_rows([dict(zip(("search", "flights", "worst so far"), row, strict=True)) for row in rows])
    at, nominal = (in_words(campaign, bad, units) for bad in (found.badness, found.nominal))
    output.say(f"worst of {found.flights} flights: number {found.flight}, {at} (nominal: {nominal})")
    if found.random_flights:
        drawn = in_words(campaign, found.random, units)
        output.say(f"worst of {found.random_flights} random flights: {drawn}")
    output.say(output.folded(f"sample: {sample_words(results.sample(found.flight), units)}", 2))
    mattered = [f"{name} {in_words(campaign, gain, units, change=True)}" for name, gain in found.influences.items()]
    output.say(output.folded(f"less bad if one moves to its other end, by: {', '.join(mattered)}", 2))
    output.say(
        f"fingerprint {row['fingerprint'] or row['crashed']}", f"scenario    {alone}", f"results     {results.path}"
    )
    if written:
        output.say(f"page        {written}")


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
    json: JsonOption = False,
) -> None:
    """Estimate the probability that a requirement breaks, with an interval from independent runs.

    The method is subset simulation, or plain sampling if it is cheaper. The exit code is 1 if there is no interval,
    because some runs did not reach a failure within the budget. After an interruption, the same command continues.

    Example: hsv rare mine.toml --of "attitude after the fault" --budget 20000
    """
    from hsv.flight.campaign.campaign import RARE, plan
    from hsv.flight.campaign.executors import make_executor
    from hsv.flight.campaign.summary import CONFIDENCE, Results
    from hsv.flight.search.rare import RUNS, estimate, least_budget, of_flights, repeated
    from hsv.flight.search.rows import Rows, is_margin
    from hsv.flight.tables import read_changes

    changed, factors = read_changes(changes or ()), read_factors(factor or ())
    planned = plan(scenario, samples=1, seed=seed, scale=scale, factors=factors, changes=changed)
    campaign = _search(planned, RARE, goal, budget)
    if not is_margin(campaign.goal):
        raise CampaignError(f"of = {goal!r}: a metric, expected a requirement of the scenario")
    if budget < least_budget():
        raise CampaignError(f"budget = {budget}: expected at least {least_budget()} flights, for independent runs")
    target = _target(out, campaign)
    with output.resumable(target.with_name(target.name + ".parts")) as complete:
        with (
            make_executor(workers, scheduler, output.errors.print) as flying,
            output.flights(campaign.scenario_name, budget) as progress,
        ):
            rows = Rows(target, campaign, flying, progress)
            d = len(campaign.factors)
            rows.run(lambda fly: estimate(of_flights(fly, campaign.factors), d, budget, seed), restart=restart)
            complete(target)
        found = repeated(Results(target, trust=True))
    if json:
        values = asdict(found) | {"confidence": CONFIDENCE, "goal": campaign.goal, "flown_now": rows.flown_now}
        output.print_json({"result": str(target), **values})
    else:
        shown = " to ".join(f"{end:.3g}" for end in found.interval) if found.interval else "not measured"
        output.say(f"probability {found.probability:.3g}, 95 % interval {shown}")
        if found.runs:
            output.say(f"runs        {', '.join(f'{p:.2g}' for p in found.runs)}; at most {found.levels} levels")
        output.say(f"flights     {found.samples}, {found.method}", f"results     {target}")
        for warning in found.warnings:
            output.report_line("hsv: warning", warning, "bold yellow")
    if not found.interval:
        raise RunError(f"no interval: {len(found.runs)} of {RUNS} runs reached the failure with {budget} flights")

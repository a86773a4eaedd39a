"""Summaries of a flight and of a campaign, on the terminal and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.text import Text

from hsv.base.errors import RunError
from hsv.base.units import UnitSystem, in_system, quantity_text, significant, unit_in
from hsv.cli import output
from hsv.flight.fingerprint import as_published, published_in_words
from hsv.flight.flight import step_times_in_words
from hsv.flight.limits import Verdict, in_units, limits_kept, missed, not_judged, verdict_sentence, verdicts
from hsv.flight.metrics import NOT_REACHED, grouped, is_share, metric_of, spaced
from hsv.flight.scenario import Scenario

if TYPE_CHECKING:
    from hsv.flight.campaign.campaign import Factor
    from hsv.flight.campaign.summary import Results, Share

_LISTED = 5
"""Number of worst flights listed on the terminal; the page has more."""


@dataclass(frozen=True)
class FlightSummary:
    """The data of a flight that has ended, from which its summary is printed."""

    scenario: Scenario
    metrics: Mapping[str, float]
    """Metrics by name, in SI units, without the margins of requirements."""
    missing: Mapping[str, str]
    """The reason for each metric that the flight does not define, by name."""
    fingerprint: str | None
    """Fingerprint of the flight; None if the recording is not complete."""
    design_hash: str
    """Digest of the design, with which :func:`as_published` finds the published fingerprint."""
    ending: str
    """``finished``, ``diverged`` or ``broken off``."""
    simulated_time: float
    """Simulated time (s) of the last step."""
    wall_time: float | None
    """Wall time (s) that the flight took; None if unknown."""
    not_covered: Sequence[str] | None
    """Items of the flight that the certificate does not cover; None if unknown."""
    disk_margin: Mapping[str, Any] | None
    """The verdict on the disk margin, see :func:`hsv.flight.margins.margin_verdict`."""
    step_times: dict[str, Any] | None = None
    """Statistics of the wall times of steps, see :func:`hsv.bags.info.describe`; None if unknown."""
    requirements: Sequence[Mapping[str, Any]] = ()
    """Margins of the requirements, see :func:`hsv.flight.requirement.requirement_rows`."""
    files: Mapping[str, Path] = field(default_factory=dict)
    """Paths of the written files, by the names under which they are printed."""


def report_flight(
    flight: FlightSummary, units: UnitSystem, json: bool, strict: bool = False, every: bool = False
) -> None:
    """Print the summary of a flight; with ``every``, metrics without a limit are marked as not judged.

    Raises:
        RunError: The flight diverged or was broken off, or, with ``strict``, it violated a limit.
    """
    scenario, time, wall_time = flight.scenario, flight.simulated_time, flight.wall_time
    finished = flight.ending == "finished"
    metrics = {**flight.metrics, **{row["metric"]: row["margin"] for row in flight.requirements}}
    judged, margin = verdicts(scenario, metrics, flight.missing, ended=finished), flight.disk_margin
    kept = finished and all(verdict.kept for verdict in judged.values()) and not missed(margin)
    factor = time / wall_time if wall_time else None
    same = as_published(flight.fingerprint, scenario, flight.design_hash)
    if json:
        output.print_json(
            {
                "scenario": scenario.name,
                "diverged_at_s": time if flight.ending == "diverged" else None,
                "within_limits": kept,
                "not_judged": not_judged(judged, metrics),
                "disk_margin": margin,
                "metrics": output.to_json({name: (v, metric_of(name).unit) for name, v in metrics.items()}, units),
                **({"requirements": flight.requirements} if flight.requirements else {}),
                "missing": flight.missing,
                "fingerprint": flight.fingerprint,
                "as_published": same,
                "wall_time_s": wall_time,
                "real_time_factor": factor,
                "step_times": flight.step_times,
                "not_covered": flight.not_covered,
                **{name: str(path) for name, path in flight.files.items()},
            }
        )
    else:
        pace = f" in {significant(wall_time)} s, {significant(factor)} x real time" if wall_time and factor else ""
        run: dict[str, object] = {
            "flown": f"{time:.6g} s{pace}",
            **({"control law": step_times_in_words(flight.step_times)} if flight.step_times else {}),
            **({"not covered": "; ".join(flight.not_covered)} if flight.not_covered else {}),
            **flight.files,
            # The fingerprint is almost as wide as a terminal, so it has a line of its own.
            "fingerprint": f"{published_in_words(flight.fingerprint, same)}\n{flight.fingerprint or ''}".rstrip(),
        }
        print_metrics(scenario.title, metrics, flight.missing, units, judged, every)
        output.print_section("run", run)
        words = verdict_sentence(judged, metrics, units, margin) if every else limits_kept(judged, units, margin)
        style = "bold red" if not kept else "bold green" if judged else "bold"
        output.console.print(Text.assemble(("verdict ", "bold"), (words, style)))
    if flight.ending == "diverged":
        raise RunError(f"flight diverged at t = {time:.2f} s: the state left the range of the model")
    if not finished:
        raise RunError(f"flight broken off at t = {time:.2f} s of {scenario.duration:.2f} s")
    if strict and not kept:
        raise RunError(limits_kept(judged, units, margin))


def print_metrics(
    title: str,
    metrics: Mapping[str, float],
    missing: Mapping[str, str],
    units: UnitSystem,
    judged: Mapping[str, Verdict] | None = None,
    every: bool = False,
) -> None:
    """Print metrics (SI) in groups with their units and, where ``judged`` is given, with their verdicts.

    Times that were not reached have a row with the reason; a line below names the metrics that do not apply. With
    ``every``, metrics without a limit are marked as not judged.
    """
    table = output.new_table("metric", "value", "unit", "verdict", title=title, right=["value"], head=False)
    table.columns[2].no_wrap = True
    late = [name for name, why in missing.items() if why.startswith(NOT_REACHED)]
    known = [*metrics, *late, *(name for name in judged or () if name not in metrics)]
    for group, named in grouped(known).items():
        table.add_row(Text(group, "bold"))
        for name, metric in named.items():
            verdict = (judged or {}).get(name)
            number, unit = in_system(metrics.get(name, math.nan), metric.unit, units, share=metric.share)
            value = significant(number) if name in metrics else "-"
            remark = Text("not judged" if every and judged is not None else missing.get(name, ""), "dim")
            if verdict and verdict.words == "not flown to the end":
                remark = Text(verdict.words, "red")
            elif verdict and verdict.requirement:
                own = ": ".join(filter(None, (verdict.requirement.id, verdict.requirement.words(units))))
                remark = Text(f"{verdict.words} ({own})", "green" if verdict.kept else "red")
            elif verdict:
                limit = in_units(name, verdict.limit, units)
                text = f"{verdict.words} (limit {limit})" if verdict.value is None else f"{verdict.words} {limit}"
                text = text if verdict.applies else verdict.words
                remark = Text(text, "green" if verdict.words == "within" else "dim" if verdict.kept else "red")
            label = verdict.requirement.name if verdict and verdict.requirement else spaced(name)
            table.add_row("  " + label, value, "" if unit == "1" else unit, remark)
    output.console.print(table)
    for reason in dict.fromkeys(why for name, why in missing.items() if name not in late):
        words = ", ".join(spaced(name) for name, why in missing.items() if why == reason)
        output.say(output.folded(f"{reason}, so these do not apply: {words}"))


def show_campaign(results: Results, units: UnitSystem, json: bool, page: bool, flown: int | None = None) -> None:
    """Print a campaign's summary and, with ``page``, write its page; ``flown`` (for JSON): number of new flights."""
    from hsv.flight.campaign.summary import CONFIDENCE, distributions, points, shares, worst_flights
    from hsv.pages.campaign import write_campaign_page

    written = results.path.with_suffix(".html") if page else None
    if json:
        output.print_json(
            {
                "result": str(results.path),
                "page": str(written) if written else None,
                "scenario": results.campaign.scenario_name,
                "method": results.campaign.method,
                "flights": results.campaign.samples,
                "lost": int(np.sum(~results.finished)),
                "flown_now": flown,
                "confidence": CONFIDENCE,
                "limits": [
                    {"limit_si": share.limit}
                    | {name: getattr(share, name) for name in ("name", "within", "fraction", "interval")}
                    for share in shares(results)
                ],
                "disk_margin": results.disk_margin,
                "grid": [
                    {
                        "values_si": point.values,
                        "finished": point.survived.within,
                        "interval": point.survived.interval,
                        "within_all": point.within_all,
                        "flights": point.survived.flights,
                    }
                    for point in points(results)
                ],
                "distributions": {
                    d.name: {
                        statistic: in_system(getattr(d, statistic), d.unit, output.json_system(units))[0]
                        for statistic in ("minimum", "median", "percentile_95", "maximum", "mean")
                    }
                    | {"unit": unit_in(output.json_system(units), d.unit), "flights": d.flights}
                    | {"not_reached": d.not_reached, "magnitude": d.title.startswith("|")}
                    for d in distributions(results)
                },
                "worst_flights": [
                    {"flight": w.flight, "limit": w.limit, "of_limit": w.ratio, "sample_si": w.sample}
                    for w in worst_flights(results, _LISTED)
                ],
            }
        )
    else:
        _print_campaign(results, units)
        output.say(f"results {results.path}")
    if written:
        write_campaign_page(results, written)
        if not json:
            output.say(f"page    {written}")


def _print_campaign(results: Results, units: UnitSystem) -> None:
    from hsv.flight.campaign.summary import ENDED, distributions, points, shares, worst_flights

    headings = ("limit", "", "within", "share", "95 % interval")
    ended = f"{lost} lost, limits are those of the others" if (lost := np.sum(~results.finished)) else "none lost"
    campaign = results.campaign
    title = f"{campaign.scenario.title}: {campaign.samples} flights, {ended}"
    table = output.new_table(*headings, title=title, right=headings[1:])
    for share in shares(results):
        limit = "" if share.limit is None else " ".join(_outcome(share.name, share.limit, units)).strip()
        within = f"{share.within} of {share.flights}", f"{100.0 * share.fraction:.3g} %"
        within = within if share.flights else ("-", "-")
        table.add_row(spaced(share.name), limit, *within, _interval(share))
    output.console.print(table)
    if results.disk_margin:
        output.say(results.disk_margin["words"])
    if swept := points(results):
        columns, unit_of = ("finished", "share", "95 % interval", "all limits"), {f.name: f.unit for f in campaign.grid}
        table = output.new_table(*swept[0].values, *columns, right=columns)
        for point in swept:
            share = point.survived
            values = [quantity_text(value, unit_of[name], units) for name, value in point.values.items()]
            counts = f"{share.within} of {share.flights}", f"{100.0 * share.fraction:.3g} %"
            table.add_row(*values, *counts, _interval(share), f"{point.within_all} of {share.flights}")
        output.console.print(table)
    numbers = ("least", "median", "95 %", "largest")
    table = output.new_table("metric", *numbers, "unit", right=numbers)
    for d in distributions(results):
        cells = [_outcome(d.name, v, units) for v in (d.minimum, d.median, d.percentile_95, d.maximum)]
        table.add_row(d.title, *(number for number, _ in cells), cells[0][1])
    output.console.print(table)
    # Without limits, the worst flights are those that ended early.
    worst = [w for w in worst_flights(results, _LISTED) if w.limit]
    if worst:
        output.console.print("worst flights:")
    for w in worst:
        used = "not reached" if math.isinf(w.ratio) else f"at {100 * w.ratio:.0f} % of its limit"
        used = w.limit if w.limit in ENDED else f"{spaced(w.limit)} {used}"
        sample = sample_words(results.campaign.factors, w.sample, units)
        output.say(output.folded(f"{w.flight}: {used}; {sample}", 4, first=2))


def _interval(share: Share) -> str:
    every = "all corners" if share.flights else "does not apply"
    return every if share.interval is None else " to ".join(f"{100.0 * p:.3g} %" for p in share.interval)


def sample_words(factors: Sequence[Factor], sample: Mapping[str, float], units: UnitSystem) -> str:
    """Return a sample (SI) of ``factors`` as a line of text in ``units``; relative changes have their sign."""
    words = []
    for factor in factors:
        number, unit = in_system(sample[factor.name], factor.unit, units, share=factor.is_perturbation)
        text = f"{number:+.3g}" if factor.is_perturbation else significant(number)
        words.append(f"{factor.name} {text}" + ("" if unit == "1" else f" {unit}"))
    return ", ".join(words)


def _outcome(name: str, value: float, units: UnitSystem) -> tuple[str, str]:
    """Return the value (SI) of the outcome ``name`` as a number in ``units``, and its unit, both as text."""
    from hsv.flight.campaign.sample_runner import OUTCOMES

    number, unit = in_system(value, OUTCOMES.get(name, "1"), units, share=is_share(name))
    if math.isinf(value):
        return "not reached", ""
    return significant(number), "" if unit == "1" else unit

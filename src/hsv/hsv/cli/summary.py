"""The summary of a flight: metrics, and the verdict against the limits of its scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path

from rich.text import Text

from hsv.base.errors import RunError
from hsv.base.units import UnitSystem, in_system, significant
from hsv.cli.output import console, folded, new_table, print_json, to_json
from hsv.flight.fingerprint import as_published, published_in_words
from hsv.flight.limits import Verdict, in_units, not_judged, verdict_sentence, verdicts
from hsv.flight.metrics import METRICS, Group
from hsv.flight.scenario import Scenario


def report_flight(
    scenario: Scenario,
    metrics: Mapping[str, float],
    *,
    fingerprint: str | None,
    design_hash: str,
    ending: str,
    wall_time: float | None,
    simulated_time: float,
    units: UnitSystem,
    json: bool,
    not_covered: Sequence[str] | None,
    files: Mapping[str, Path] | None = None,
) -> None:
    """Print the summary of a flight.

    Args:
        scenario: Scenario that was flown.
        metrics: Metrics by name, in SI units.
        fingerprint: Fingerprint of the flight; ``None`` if steps are missing.
        design_hash: Digest of the design's parameters.
        ending: ``finished``, ``diverged`` or ``broken off``.
        wall_time: Wall time (s) that the flight took, where it is known.
        simulated_time: Simulated time (s) of the last step.
        units: UnitSystem of what is printed.
        json: Whether to print JSON.
        not_covered: Items of the flight that the certificate does not cover; ``None``: not known.
        files: Written files by name.

    Raises:
        RunError: The flight diverged or was broken off; the message says when.
    """
    quantities = {name: (value, METRICS[name].unit) for name, value in metrics.items()}
    finished = ending == "finished"
    judged = verdicts(scenario, metrics, ended=finished)
    factor = simulated_time / wall_time if wall_time else None
    same = as_published(fingerprint, scenario, design_hash)
    if json:
        print_json(
            {
                "scenario": scenario.name,
                "diverged_at_s": simulated_time if ending == "diverged" else None,
                "within_limits": finished and all(verdict.within for verdict in judged.values()),
                "not_judged": not_judged(judged, metrics),
                "metrics": to_json(quantities, units),
                "fingerprint": fingerprint,
                "as_published": same,
                "wall_time_s": wall_time,
                "real_time_factor": factor,
                "not_covered": not_covered,
                **{name: str(path) for name, path in (files or {}).items()},
            }
        )
    else:
        pace = f" in {significant(wall_time)} s, {significant(factor)} x real time" if wall_time and factor else ""
        run: dict[str, object] = {
            "flown": f"{simulated_time:.6g} s{pace}",
            **({"not covered": "; ".join(not_covered)} if not_covered else {}),
            **(files or {}),
            # Alone on a line it is as wide as a terminal.
            "fingerprint": f"{published_in_words(fingerprint, same)}\n{fingerprint or ''}".rstrip(),
        }
        print_metrics(scenario.title, metrics, units, judged)
        print_section("run", run)
        console.print(_verdict(judged, metrics, units, finished))
    if ending == "diverged":
        raise RunError(f"flight diverged at t = {simulated_time:.2f} s: the state left the range of the model")
    if not finished:
        raise RunError(f"flight broken off at t = {simulated_time:.2f} s of {scenario.duration:.2f} s")


def print_metrics(
    title: str, metrics: Mapping[str, float], units: UnitSystem, judged: Mapping[str, Verdict] | None = None
) -> None:
    """Print metrics (SI) in groups, each in words, with its unit and, where ``judged`` is given, with the verdict."""
    table = new_table("metric", "value", "unit", "verdict", title=title, right=["value"], head=False)
    table.columns[2].no_wrap = True
    known = [*metrics, *(name for name in judged or () if name not in metrics)]
    for group in Group:
        names = [name for name in METRICS if name in known and METRICS[name].group is group]
        if names:
            table.add_row(Text(group, "bold"))
        for name in names:
            metric, verdict = METRICS[name], (judged or {}).get(name)
            number, unit = in_system(metrics.get(name, nan), metric.unit, units, share=metric.share)
            value = significant(number) if name in metrics else "-"
            remark = Text() if judged is None else _remark(name, verdict, units)
            table.add_row("  " + metric.words, value, "" if unit == "1" else unit, remark)
    console.print(table)


def print_section(title: str, lines: Mapping[str, object]) -> None:
    """Print what has a name and is no number under a title, a line each, folded between words; no path, to be copied.

    What follows a line break in a text stands on a line of its own.
    """
    console.print(Text(title, "bold"))
    width = max(map(len, lines)) + 4
    for name, text in lines.items():
        first, *others = str(text).split("\n")
        words = first if isinstance(text, Path) else folded(first, width, first=width)[width:]
        for line in (f"  {name:{width - 2}}{words}", *(f"  {other}" for other in others)):
            console.print(line, soft_wrap=True)


def _remark(name: str, verdict: Verdict | None, units: UnitSystem) -> Text:
    if verdict is None:
        return Text("not judged", "dim")
    if verdict.words == "not flown to the end":
        return Text(verdict.words, "red")
    limit = in_units(name, verdict.limit, units)
    text = f"{verdict.words} (limit {limit})" if verdict.value is None else f"{verdict.words} {limit}"
    return Text(text, "green" if verdict.within else "red")


def _verdict(judged: Mapping[str, Verdict], metrics: Mapping[str, float], units: UnitSystem, finished: bool) -> Text:
    kept = finished and all(verdict.within for verdict in judged.values())
    style = "bold red" if not kept else "bold green" if judged else "bold"
    return Text.assemble(("verdict ", "bold"), (verdict_sentence(judged, metrics, units), style))

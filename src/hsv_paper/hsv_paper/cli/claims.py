"""The command ``hsv-paper claims``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from hsv.base.units import UnitSystem, in_system, significant, unit_in
from hsv.cli.options import FlightsOption, JsonOption, UnitsOption
from hsv.cli.output import check_folder, check_target, console, new_table, print_json, stages

if TYPE_CHECKING:
    from hsv_paper.claims.claim import Judged
    from hsv_paper.claims.ranking import Rank


def claims(
    out: Annotated[Path | None, typer.Option(help="Also write a page on all claims to this file, in Markdown.")] = None,
    flights: FlightsOption = Path("bags/study"),
    verbose: Annotated[bool, typer.Option("--verbose", help="Print quotes, readings and reasons, too.")] = False,
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Measure and judge every checkable claim of the paper, for the nominal vehicle and all corners of the parameters.

    The first run takes several minutes: more than a dozen scenarios are flown with 1025 vehicles each. The flights are
    stored and reused.

    Example: hsv-paper claims --out docs/claims.md
    """
    from hsv_paper.claims.catalogue import judge
    from hsv_paper.claims.evidence import Evidence
    from hsv_paper.claims.page import page
    from hsv_paper.claims.ranking import ranking

    if out:
        check_target(out, "out")
    check_folder(flights, "flights")
    with stages() as progress:
        evidence = Evidence(flights, progress)
        judged = judge(evidence, progress)
        ranks = ranking(evidence)
    if out:
        out.write_text(page(judged, ranks), encoding="utf-8")
    if json:
        print_json(
            {
                "claims": [_as_json(group, entry) for group, entries in judged.items() for entry in entries],
                "ranking": {metric: {name: vars(rank) for name, rank in row.items()} for metric, row in ranks.items()},
            }
        )
        return
    _print_claims(judged, verbose, units)
    _print_ranking(ranks, units)


def _as_json(group: str, entry: Judged) -> dict[str, Any]:
    return {
        "group": group,
        "name": entry.claim.name,
        "quote": entry.claim.quote,
        "location": entry.claim.location,
        "verdict": str(entry.finding.verdict),
        "why": entry.finding.why,
        "readings": [{**vars(reading), "holds": reading.holds} for reading in entry.finding.readings],
    }


def _print_claims(judged: dict[str, list[Judged]], verbose: bool, units: UnitSystem) -> None:
    from rich.padding import Padding

    from hsv_paper.claims.page import tally

    for group, entries in judged.items():
        console.print(group, style="bold")
        if verbose:
            for entry in entries:
                name, where = (f"  {entry.claim.name}", "bold"), f" ({entry.claim.location}): "
                console.print(Text.assemble(name, where, _verdict(entry)))
                console.print(Padding(f'"{entry.claim.quote}"', (0, 0, 0, 4)))
                for number, reading in enumerate(entry.finding.readings):
                    mark = "*" if number < entry.finding.leading else " "
                    behind = f", actuators {reading.actuators}" if reading.actuators else ""
                    said = f"{mark} {'yes' if reading.holds else 'no ':3}  {reading.what}{behind}: "
                    said += f"{reading.measured(units)} ({reading.threshold(units)})"
                    console.print(Padding(said, (0, 0, 0, 4)))
                console.print(Padding(entry.finding.why, (0, 0, 1, 4)))
            continue
        table = new_table("claim", "location", "verdict", head=False)
        for column, width in zip(table.columns, (_NAME, _LOCATION, None), strict=True):
            column.width, column.no_wrap = width, True
        for entry in entries:
            table.add_row(entry.claim.name, _shorter(entry.claim.location), _verdict(entry))
        console.print(table)
    if verbose:
        console.print("* the statement itself; the other readings repeat it under other conditions")
    console.print(f"{tally(judged)}\n", style="bold")


_NAME, _LOCATION = 43, 11
"""Columns of the names and locations: with the longest verdict they fill the 80 of a terminal."""


def _shorter(location: str) -> str:
    return location.rpartition(", ")[2].replace("Figures", "Fig.").replace("Figure", "Fig.").replace(" and ", ", ")


def _verdict(entry: Judged) -> Text:
    from hsv_paper.claims.finding import Verdict

    colours = {Verdict.HOLDS: "green", Verdict.CONDITIONS: "yellow", Verdict.FAILS: "red"}
    return Text(str(entry.finding.verdict), colours[entry.finding.verdict])


def _print_ranking(ranks: dict[str, dict[str, Rank]], units: UnitSystem) -> None:
    from hsv_paper.claims.page import mean_places
    from hsv_paper.claims.ranking import METRICS

    places = mean_places(ranks)
    table = new_table("Case 1, smaller is better", "", *places)
    table.columns[0].width, table.columns[1].no_wrap = 29, True
    for column in table.columns[2:]:
        column.justify, column.min_width = "right", 8
    for metric, row in ranks.items():
        what, unit = METRICS[metric]
        said = f"{what}, {unit_in(units, unit)}".removesuffix(", 1")
        table.add_row(said, "nominal\nworst", *(Text("\n").join(_ranked(rank, unit, units)) for rank in row.values()))
    table.add_row("mean rank", "nominal\nworst", *("\n".join(f"{p:.1f}" for p in pair) for pair in places.values()))
    console.print(table)


def _ranked(rank: Rank, unit: str, units: UnitSystem) -> list[Text]:
    """Return both numbers of a rank, bold where it is the best."""
    both = ((rank.nominal, rank.nominal_place), (rank.worst, rank.worst_place))
    numbers = [(significant(in_system(value, unit, units)[0]), place) for value, place in both]
    return [Text(number, "bold" if place == 1 else "") for number, place in numbers]

"""The command ``hsv claims``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hsv.cli.options import FlightsOption, JsonOption
from hsv.cli.output import console, print_json
from hsv.cli.targets import check_folder, check_target

if TYPE_CHECKING:
    from hsv.study.claims.claim import Judged


def claims(
    out: Annotated[Path | None, typer.Option(help="Also write the page of all claims here, in Markdown.")] = None,
    flights: FlightsOption = Path("bags/study"),
    json: JsonOption = False,
) -> None:
    """Measure every checkable statement of the paper, nominal and at all corners of the parameters, and judge it.

    The first time takes some minutes: eight scenarios are flown by 1025 vehicles each. What was flown is kept.

    Example: hsv claims --out docs/claims.md
    """
    from hsv.cli.progress import stages
    from hsv.study.claims.catalogue import judge
    from hsv.study.claims.evidence import Evidence
    from hsv.study.claims.page import page
    from hsv.study.claims.ranking import ranking

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
    else:
        _print(judged)


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


def _print(judged: dict[str, list[Judged]]) -> None:
    from rich.table import Table

    from hsv.study.claims.page import condition, shown

    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("claim", "where", "reading", "measured", "threshold", "verdict"):
        table.add_column(heading, justify="right" if heading == "measured" else "left")
    for entries in judged.values():
        for entry in entries:
            cells = [entry.claim.name, entry.claim.location]
            verdict = f"[bold]{entry.finding.verdict}[/]"
            for reading in entry.finding.readings:
                style = "" if reading.holds else "[red]"
                measured = f"{style}{shown(reading.value, reading.unit)}"
                table.add_row(*cells, reading.what, measured, condition(reading), verdict)
                cells, verdict = ["", ""], ""
    console.print(table)

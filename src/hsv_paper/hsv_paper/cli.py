"""The hsv-paper command: figures and claims of the paper, sensitivity of its choices, and physical limits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hsv.base.errors import QuantityError, one_of
from hsv.cli.entry import Command
from hsv.cli.main import run
from hsv.cli.options import JsonOption, check_folder, check_target
from hsv.cli.output import console, print_estimate, print_json, stages

if TYPE_CHECKING:
    from hsv_paper.claims.page import Ranks
    from hsv_paper.claims.table import Finding
    from hsv_paper.study import Study

COMMANDS = {name: Command(__name__) for name in ("figures", "claims", "sensitivity", "limits")}
"""Places of the commands."""

FlightsOption = Annotated[Path, typer.Option(help="Folder in which the study's flights are stored and reused.")]
CoarsenessOption = Annotated[float, typer.Option(help="1: as in the docs; 4: a quarter of the points.")]
StudyOption = Annotated[Path, typer.Option("--out", help="Folder for a PDF, a PNG and a page on the study.")]

_FLIGHTS = Path("bags/study")

_FIGURE, _CLAIMS = 4.0, 900.0
"""Time (s) on one processor: of a figure, and of the claims with their 17 scenarios of 1025 vehicles each."""


def main() -> None:
    """Run the command line."""
    run("hsv-paper", COMMANDS, "Draw the figures of the paper, judge its claims, and vary its choices.")


def figures(
    only: Annotated[list[int] | None, typer.Option(help="Draw only this figure of the paper; can be repeated.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for a PDF, a PNG and a page of each figure.")] = Path("figures"),
    json: JsonOption = False,
) -> None:
    """Draw the paper's figures from this project's designs and flights, for comparison with the paper's.

    The flights are computed in this process; those of the nodes, hsv run NAME, have the same numbers bit for bit.

    Example: hsv-paper figures --only 9 --only 11 --out figures
    """
    import matplotlib

    from hsv_paper.figures import FIGURES
    from hsv_paper.flights import Flights
    from hsv_paper.plots import RC, save

    for number in only or ():
        if number not in FIGURES:
            raise QuantityError(f"only = {number}: expected one of {', '.join(map(str, FIGURES))}")
    chosen = [figure for number, figure in FIGURES.items() if not only or number in only]
    check_folder(out, "out")
    out.mkdir(parents=True, exist_ok=True)
    print_estimate(_FIGURE * len(chosen), json)
    rows: list[dict[str, Any]] = []
    with stages() as progress, matplotlib.rc_context(RC):
        source = Flights(out)
        for done, figure in enumerate(chosen):
            progress("figures", done, len(chosen))
            drawing = figure.draw(source)
            paths = save(drawing.figure, out / figure.stem)
            rows.append({"number": figure.number, "paths": list(map(str, paths))})
            (out / f"{figure.stem}.md").write_text(figure.page(drawing), encoding="utf-8")
        progress("figures", len(chosen), len(chosen))
    if json:
        print_json({"figures": rows})
        return
    for row in rows:
        console.print(f"Figure {row['number']:2}  {', '.join(row['paths'])}", soft_wrap=True)


def claims(
    out: Annotated[Path | None, typer.Option(help="Also write a page on all claims to this file, in Markdown.")] = None,
    flights: FlightsOption = _FLIGHTS,
    json: JsonOption = False,
) -> None:
    """Measure and judge every checkable claim of the paper, for the nominal vehicle and all corners of the parameters.

    The first run takes several minutes: more than a dozen scenarios are flown with 1025 vehicles each. The flights are
    stored and reused. The page has quotes, readings and reasons.

    Example: hsv-paper claims --out docs/claims.md
    """
    from hsv_paper.claims.evidence import Evidence
    from hsv_paper.claims.page import page, ranking
    from hsv_paper.claims.table import judge

    if out:
        check_target(out, "out")
    check_folder(flights, "flights")
    print_estimate(_CLAIMS, json, f", less with the flights kept in {flights}")
    with stages() as progress:
        evidence = Evidence(flights, progress)
        judged = judge(evidence, progress)
        ranks = ranking(evidence)
    if out:
        out.write_text(page(judged, ranks), encoding="utf-8")
    if json:
        ranked = {metric: {name: vars(rank) for name, rank in row.items()} for metric, row in ranks.items()}
        entries = [claim_json(group, found) for group, findings in judged.items() for found in findings]
        print_json({"claims": entries, "ranking": ranked})
    else:
        print_claims(judged, ranks)


def claim_json(group: str, found: Finding) -> dict[str, Any]:
    """Return a claim with its finding for JSON."""
    return {
        "group": group,
        "name": found.claim.name,
        "quote": found.claim.quote,
        "location": found.claim.location,
        "verdict": str(found.verdict),
        "why": found.why,
        "readings": [{**vars(reading), "holds": reading.holds} for reading in found.readings],
    }


def print_claims(judged: dict[str, list[Finding]], ranks: Ranks) -> None:
    """Print a line of at most 80 characters for each claim, and the ranking."""
    from rich.markdown import Markdown

    from hsv_paper.claims.page import ranking_table, tally

    for group, findings in judged.items():
        console.print(group, style="bold")
        for found in findings:
            where = found.claim.location.rpartition(", ")[2].replace("Figures", "Fig.").replace("Figure", "Fig.")
            console.print(f"{found.claim.name:43} {where.replace(' and ', ', '):12} {found.verdict}", highlight=False)
    console.print(f"{tally(judged)}\n", style="bold")
    console.print(Markdown(ranking_table(ranks)))


def sensitivity(
    name: Annotated[
        str, typer.Argument(help="coupling, sampling, notch, parameters, fault, weights, ramp, factor or hardware.")
    ],
    out: StudyOption = Path("study"),
    flights: FlightsOption = _FLIGHTS,
    coarseness: CoarsenessOption = 1.0,
    beside: Annotated[
        list[str], typer.Option("--with", help="Also fly the controller of this scenario; can be repeated.")
    ] = [],  # noqa: B006
    json: JsonOption = False,
) -> None:
    """Vary one thing that the paper leaves open until each controller is lost; plot the results and state the limits.

    Example: hsv-paper sensitivity fault --with examples/lqr/lqr.toml --out study
    """
    from hsv_paper.sensitivity import STUDIES
    from hsv_paper.sensitivity.flown import others_with_elevator_fault

    if name not in STUDIES:
        raise QuantityError(f"sensitivity = {name!r}: expected {one_of(STUDIES, name)}")
    if beside and not STUDIES[name].flies_others:
        able = ", ".join(n for n, study in STUDIES.items() if study.flies_others)
        raise QuantityError(f"with = {beside[0]!r}: study {name} flies its own controllers, expected study {able}")
    others_with_elevator_fault(beside)
    make(STUDIES[name], out, flights, coarseness, beside, json)


def make(study: Study, out: Path, flights: Path, coarseness: float, beside: list[str], json: bool) -> None:
    """Make a study, write its figure and its page, and print its findings."""
    import matplotlib

    from hsv_paper.plots import RC, save
    from hsv_paper.study import Scope, markdown

    if not 1.0 <= coarseness <= 100.0:
        raise QuantityError(f"coarseness = {coarseness}: expected 1 to 100")
    check_folder(out, "out")
    check_folder(flights, "flights")
    print_estimate(60.0 * study.minutes / coarseness, json, f", less with the flights kept in {flights}")
    out.mkdir(parents=True, exist_ok=True)
    with stages() as progress, matplotlib.rc_context(RC):
        outcome = study.run(Scope(coarseness, flights, progress, beside))
        written = save(outcome.figure, out / study.name)
    target = out / f"{study.name}.md"
    target.write_text(study.page(outcome), encoding="utf-8")
    if json:
        print_json({"study": study.name, "tables": outcome.tables})
        return
    for table in outcome.tables:
        console.print(markdown(table), soft_wrap=True, highlight=False)
    console.print(f"written {', '.join(map(str, (*written, target)))}", soft_wrap=True)


def limits(
    out: StudyOption = Path("study"),
    flights: FlightsOption = _FLIGHTS,
    coarseness: CoarsenessOption = 1.0,
    json: JsonOption = False,
) -> None:
    """Find by optimal control the fastest transfer and the deepest fault from which any controller could recover.

    Example: hsv-paper limits --out study
    """
    from hsv_paper.limits.study import STUDY

    make(STUDY, out, flights, coarseness, [], json)

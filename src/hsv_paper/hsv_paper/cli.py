"""The hsv-paper command: figures and claims of the paper, sensitivity of its choices, and the gap of certificates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.base.errors import QuantityError, one_of
from hsv.cli.entry import Command
from hsv.cli.main import run
from hsv.cli.options import check_folder, check_target
from hsv.cli.output import console, print_estimate, print_written, stages

COMMANDS = {name: Command(__name__) for name in ("figures", "claims", "sensitivity", "gap")}
"""The commands and the module that holds them."""

_FIGURE, _CLAIMS = 4.0, 120.0
"""Time (s) on one processor: of a figure, and of all claims, for which 1025 vehicles fly ten scenarios."""


def main() -> None:
    """Run the command line."""
    run("hsv-paper", COMMANDS, "Draw the figures of the paper, judge its claims, and vary its choices.")


def figures(
    only: Annotated[list[int] | None, typer.Option(help="Draw only this figure of the paper; can be repeated.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for a PDF and a PNG of each figure.")] = Path("figures"),
) -> None:
    """Draw the paper's figures from this project's designs and flights, for comparison with the paper's.

    The flights are computed in this process; those of the nodes, hsv run NAME, have the same numbers bit for bit.
    docs/figures compares each figure with the paper's.

    Example: hsv-paper figures --only 9 --only 11 --out figures
    """
    import matplotlib

    from hsv_paper.figures import FIGURES
    from hsv_paper.plots import RC, save

    for number in only or ():
        if number not in FIGURES:
            raise QuantityError(f"only = {number}: expected one of {', '.join(map(str, FIGURES))}")
    chosen = {number: draw for number, draw in FIGURES.items() if not only or number in only}
    check_folder(out, "out")
    out.mkdir(parents=True, exist_ok=True)
    print_estimate(_FIGURE * len(chosen), as_json=False)
    written: list[Path] = []
    with stages() as progress, matplotlib.rc_context(RC):
        for done, (number, draw) in enumerate(chosen.items()):
            progress("figures", done, len(chosen))
            written += save(draw(), out / f"figure_{number:02}")
        progress("figures", len(chosen), len(chosen))
    print_written(written, as_json=False)


def claims(
    out: Annotated[Path | None, typer.Option(help="Also write a page on all claims to this file, in Markdown.")] = None,
) -> None:
    """Measure and judge every checkable claim of the paper, for the nominal vehicle and all corners of the parameters.

    This takes a few minutes: ten scenarios are flown by 1025 vehicles each. The page has quotes, readings and reasons.

    Example: hsv-paper claims --out docs/claims.md
    """
    from hsv_paper.claims.evidence import Evidence
    from hsv_paper.claims.page import page, tally
    from hsv_paper.claims.table import judge

    if out:
        check_target(out, "out")
    print_estimate(_CLAIMS, as_json=False)
    with stages() as progress:
        judged = judge(Evidence(progress), progress)
    if out:
        out.write_text(page(judged), encoding="utf-8")
    for group, findings in judged.items():
        console.print(group, style="bold")
        for found in findings:
            where = found.claim.location.rpartition(", ")[2].replace("Figures", "Fig.").replace("Figure", "Fig.")
            console.print(f"{found.claim.name:43} {where.replace(' and ', ', '):12} {found.verdict}", highlight=False)
    console.print(tally(judged), style="bold")


def sensitivity(
    name: Annotated[str, typer.Argument(help="coupling, notch, parameters, fault or factor.")],
    out: Annotated[Path, typer.Option(help="Folder for a PDF, a PNG and a page on the study.")] = Path("study"),
    coarseness: Annotated[float, typer.Option(help="1: as in the docs; 4: a quarter of the points.")] = 1.0,
) -> None:
    """Vary one thing that the paper leaves open until each controller is lost; plot the results and state the limits.

    Example: hsv-paper sensitivity fault --out study
    """
    import matplotlib

    from hsv_paper.plots import RC, save
    from hsv_paper.sensitivity import STUDIES
    from hsv_paper.study import Scope, markdown

    if name not in STUDIES:
        raise QuantityError(f"sensitivity = {name!r}: expected {one_of(STUDIES, name)}")
    study = STUDIES[name]
    if not 1.0 <= coarseness <= 100.0:
        raise QuantityError(f"coarseness = {coarseness}: expected 1 to 100")
    check_folder(out, "out")
    print_estimate(60.0 * study.minutes / coarseness, as_json=False)
    out.mkdir(parents=True, exist_ok=True)
    with stages() as progress, matplotlib.rc_context(RC):
        outcome = study.run(Scope(coarseness, progress))
        written = save(outcome.figure, out / name)
    page = out / f"{name}.md"
    page.write_text(study.page(outcome), encoding="utf-8")
    for table in outcome.tables:
        console.print(markdown(table), soft_wrap=True, highlight=False)
    print_written([*written, page], as_json=False)


def gap(
    verified: Annotated[list[Path], typer.Argument(help="Output of hsv verify NAME --json, each in a file NAME.json.")],
    out: Annotated[Path, typer.Option(help="Folder for a PDF and a PNG of the figure.")] = Path("gap"),
    over: Annotated[str, typer.Option(help="Design whose W is compared with parts of its tube.")] = "baseline",
) -> None:
    """Compare what is certified with worst sequences and with drawn flights, and print the tables of docs/gap.md.

    The bounds are those of the certificates, which hsv verify recomputes; those at limited rates are computed here.

    Example: hsv-paper gap verified/baseline.json verified/robust.json --out docs/images
    """
    import matplotlib

    from hsv_paper.gap import bound_rows, draw, flight_rows, gap_of, needed_rows
    from hsv_paper.plots import RC, save
    from hsv_paper.study import markdown

    check_folder(out, "out")
    out.mkdir(parents=True, exist_ok=True)
    with stages() as progress, matplotlib.rc_context(RC):
        found = gap_of(verified, progress)
        tables = bound_rows(found), flight_rows(found), needed_rows(over, progress)
        written = save(draw(found), out / "gap")
    for table in tables:
        console.print(markdown(table), soft_wrap=True, highlight=False)
        console.print()
    print_written(written, as_json=False)

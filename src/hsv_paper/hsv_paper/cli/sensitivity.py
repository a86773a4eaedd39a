"""The command ``hsv-paper sensitivity``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import FlightsOption, JsonOption
from hsv.cli.output import check_folder, console, print_json, stages


def sensitivity(
    name: Annotated[
        str,
        typer.Argument(help="coupling, sampling, notch, parameters, fault, weights, ramp, factor, hardware or limits."),
    ],
    out: Annotated[Path, typer.Option(help="Folder for a PDF, a PNG and a page on the study.")] = Path("study"),
    flights: FlightsOption = Path("bags/study"),
    coarseness: Annotated[float, typer.Option(help="1: as in the docs; 4: a quarter of the points.")] = 1.0,
    beside: Annotated[
        list[str], typer.Option("--with", help="Also fly the controller of this scenario; can be repeated.")
    ] = [],  # noqa: B006
    json: JsonOption = False,
) -> None:
    """Vary one thing that the paper leaves open until each controller is lost; plot the results and state the limits.

    Example: hsv-paper sensitivity fault --with examples/lqr/lqr.toml --out study
    """
    import matplotlib

    from hsv.base.errors import QuantityError
    from hsv_paper.figures.style import RC, save
    from hsv_paper.sensitivity.catalogue import STUDIES, page

    if name not in STUDIES:
        raise QuantityError(f"sensitivity = {name!r}: expected one of {', '.join(STUDIES)}")
    if not 1.0 <= coarseness <= 100.0:
        raise QuantityError(f"coarseness = {coarseness}: expected 1 to 100")
    chosen = STUDIES[name]
    if beside and chosen.run_beside is None:
        able = ", ".join(n for n, study in STUDIES.items() if study.run_beside)
        raise QuantityError(f"with = {beside[0]!r}: study {name} flies its own controllers, expected study {able}")
    check_folder(out, "out")
    check_folder(flights, "flights")
    out.mkdir(parents=True, exist_ok=True)
    with stages() as progress, matplotlib.rc_context(RC):
        if beside and chosen.run_beside:
            outcome = chosen.run_beside(coarseness, flights, progress, beside)
        else:
            outcome = chosen.run(coarseness, flights, progress)
        written = save(outcome.figure, out / name)
    target = out / f"{name}.md"
    target.write_text(page(chosen, outcome), encoding="utf-8")
    if json:
        print_json({"study": name, "findings": list(outcome.findings), "numbers": outcome.numbers})
        return
    for finding in outcome.findings:
        console.print(f"- {finding}", soft_wrap=True)
    console.print(f"written {', '.join(map(str, (*written, target)))}", soft_wrap=True)

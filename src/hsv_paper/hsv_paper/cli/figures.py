"""The command ``hsv-paper figures``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.options import FlightsOption, JsonOption
from hsv.cli.output import check_folder, console, errors, print_json, stages


def figures(
    only: Annotated[list[int] | None, typer.Option(help="Draw only this figure of the paper; can be repeated.")] = None,
    out: Annotated[Path, typer.Option(help="Folder for a PDF, a PNG and a page of each figure.")] = Path("figures"),
    flights: FlightsOption = Path("bags/study"),
    json: JsonOption = False,
) -> None:
    """Draw the paper's figures from this project's designs and flights, for comparison with the paper's.

    The flights are runs of the graph, recorded to bags. The bags are reused as long as nothing they depend on changes,
    including the nodes and their messages. Without the nodes, the flights are computed in this process, with the same
    numbers.

    Example: hsv-paper figures --only 9 --only 11 --out figures
    """
    import matplotlib

    from hsv.base.errors import QuantityError
    from hsv_paper.figures.catalogue import FIGURES
    from hsv_paper.figures.figure import Material
    from hsv_paper.figures.page import page
    from hsv_paper.figures.style import RC, save
    from hsv_paper.flights import Flights, graph_is_there

    for number in only or ():
        if number not in FIGURES:
            raise QuantityError(f"only = {number}: expected one of {', '.join(map(str, FIGURES))}")
    chosen = [figure for number, figure in FIGURES.items() if not only or number in only]
    check_folder(out, "out")
    check_folder(flights, "flights")
    graph = graph_is_there()
    if not graph and any(figure.scenarios for figure in chosen):
        errors.print("no built ROS workspace is sourced: flown in this process, with the same numbers bit for bit")
    out.mkdir(parents=True, exist_ok=True)
    written = []
    with stages() as progress, matplotlib.rc_context(RC):
        material = Material(Flights(flights, graph=graph, progress=progress))
        for done, figure in enumerate(chosen):
            progress("figures", done, len(chosen))
            drawing = figure.draw(material)
            written.append(save(drawing.figure, out / figure.stem))
            (out / f"{figure.stem}.md").write_text(page(figure, drawing), encoding="utf-8")
        progress("figures", len(chosen), len(chosen))
    if json:
        made = zip(chosen, written, strict=True)
        print_json({"figures": [{"number": f.number, "paths": [str(path) for path in paths]} for f, paths in made]})
        return
    for figure, paths in zip(chosen, written, strict=True):
        console.print(f"Figure {figure.number:2}  {', '.join(map(str, paths))}", soft_wrap=True)

"""The command that compares campaigns."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from rich.text import Text
from typer import Argument, Option

from hsv.base.errors import CampaignError
from hsv.base.units import UnitSystem
from hsv.cli import output
from hsv.cli.options import JsonOption, UnitsOption, check_target, writing

_FIGURES = (".pdf", ".svg", ".png")


def compare(
    results: Annotated[list[Path], Argument(help="Result files of campaigns; the first is the reference.")],
    metric: Annotated[list[str] | None, Option(help="Metric, repeatable; default: the limited ones.")] = None,
    page: Annotated[Path, Option(help="HTML file to write.")] = Path("comparison.html"),
    csv: Annotated[Path | None, Option(help="Write the table, in SI, to this .csv file.")] = None,
    latex: Annotated[Path | None, Option(help="Write the table for LaTeX to this .tex file.")] = None,
    out: Annotated[Path | None, Option(help="Write a figure to this .pdf, .svg or .png file.")] = None,
    size: Annotated[str, Option(help="Width and height of the figure, such as 85x60mm.")] = "",
    units: UnitsOption = UnitSystem.metric,
    json: JsonOption = False,
) -> None:
    """Compare campaigns: the same vehicles in pairs, differences with bootstrap intervals, a page and a figure.

    Campaigns with the same seed, sampling and factors have the same vehicles and noise. Pairs of which a flight is lost
    are dropped and counted. For bags, use hsv report and hsv diff.

    Example: hsv compare campaigns/tube.parquet campaigns/lqr.parquet --latex table.tex --out figure.pdf
    """
    from hsv.flight.campaign.comparison import ENDED, compare_campaigns
    from hsv.flight.campaign.summary import Results
    from hsv.pages.campaign_plots import campaign_figure
    from hsv.pages.comparison import comparison_rows, dropped, write_comparison_page
    from hsv.pages.comparison import latex as latex_text
    from hsv.pages.plots import Layout, save_figure

    check_target(page, "page", ".html", ".htm")
    for field, path, suffixes in (("csv", csv, [".csv"]), ("latex", latex, [".tex"]), ("out", out, _FIGURES)):
        if path:
            check_target(path, field, *suffixes)
    if len({path.stem for path in results}) < len(results):
        raise CampaignError("results: two files have the same name, expected different ones, which label the campaigns")
    layout = Layout.of(size=size)
    campaigns = {path.stem: Results(path) for path in results}
    table = compare_campaigns({label: each.frame() for label, each in campaigns.items()}, metric or ())
    options = [f"--metric={name}" for name in metric or ()]
    command = shlex.join(["hsv", "compare", *map(str, results), *options])
    write_comparison_page(campaigns, table, page, units, command)
    rows, written = comparison_rows(table, units), [page]
    if csv:
        with writing(csv, "csv"):
            table.to_csv(csv, index=False)
        written.append(csv)
    if latex:
        with writing(latex, "latex"):
            latex.write_text(latex_text(rows), encoding="utf-8")
        written.append(latex)
    if out:
        metrics = [name for name in dict.fromkeys(table["metric"]) if name != ENDED]
        with writing(out, "out"):
            save_figure(campaign_figure(campaigns, units, metrics, layout), out)
        written.append(out)
    if json:
        output.print_json({"rows": table.to_dict("records"), **table.attrs, "written": [str(path) for path in written]})
        return
    for name in dict.fromkeys(row["metric"] for row in rows):
        output.say(Text(name, "bold"))
        own = [row for row in rows if row["metric"] == name]
        output.print_rows([{key: row[key] for key in row if key not in ("metric", "flights", "pairs")} for row in own])
    output.say(*dropped(table, results[0].stem), *(f"written {path}" for path in written))

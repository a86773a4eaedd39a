"""The comparison of campaigns as a table of texts, in LaTeX, and as a self-contained HTML page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hsv.base.errors import CampaignError
from hsv.base.units import UnitSystem, in_system, significant
from hsv.flight.campaign.comparison import ENDED
from hsv.flight.campaign.summary import Results, title_of
from hsv.flight.metrics import is_share
from hsv.pages.campaign_plots import campaign_figure
from hsv.pages.engine import render, write_page
from hsv.pages.plots import inline_svg

if TYPE_CHECKING:
    from pandas import DataFrame

_ESCAPED = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "|": r"\textbar{}"}
_ESCAPED |= {sign: "\\" + sign for sign in "&%$#_{}"} | {"∞": r"$\infty$"}


def comparison_rows(table: DataFrame, system: UnitSystem) -> list[dict[str, str]]:
    """Return the rows of a table of :func:`hsv.flight.campaign.comparison.compare_campaigns` as texts by heading."""
    return [_row(row, system) for row in table.to_dict("records")]


def _row(row: dict[str, object], system: UnitSystem) -> dict[str, str]:
    name, unit = str(row["metric"]), str(row["unit"])
    share = name == ENDED or is_share(name)

    def text(key: str) -> str:
        value = row.get(key)
        if not isinstance(value, float) or math.isnan(value):
            return "-"
        return significant(in_system(value, unit, system, share=share)[0]).replace("inf", "∞")

    def percentage(key: str) -> str:
        value = row.get(key)
        return "-" if not isinstance(value, float) or math.isnan(value) else f"{100.0 * value:.3g} %"

    shown = in_system(1.0, unit, system, share=share)[1]
    words = "flown to the end" if name == ENDED else title_of(name)
    interval = f"{text('low')} to {text('high')}"
    return {
        "metric": words + ("" if shown == "1" else f" [{shown}]"),
        "campaign": str(row["campaign"]),
        "flights": str(row["flights"]),
        "within": percentage("within"),
        "median": text("median"),
        "95 %": text("percentile_95"),
        "difference": text("difference"),
        "95 % interval": "-" if text("low") == "-" else interval,
        "better": percentage("better"),
        "pairs": "-" if math.isnan(float(row["pairs"])) else f"{row['pairs']:.0f}",  # type: ignore[arg-type]
    }


def dropped(table: DataFrame, first: str) -> list[str]:
    """Return a line for each campaign: how many pairs it has with the ``first``, and which flights were dropped."""
    lines = []
    for label, count in table.attrs["pairs"].items():
        lost = f"{count['lost_only_here']} lost only in {label}, {count['lost_only_in_first']} only in {first}"
        ends = f"{count['lost_in_both']} in both; {count['without_partner']} flights without a partner"
        lines.append(f"{label}: {count['both_finish']} pairs finish; dropped: {lost}, {ends}")
    return lines


def latex(rows: Sequence[Mapping[str, str]]) -> str:
    """Return the rows as a LaTeX table with the rules of the package booktabs; all special characters are escaped."""

    def line(cells: Sequence[str]) -> str:
        return " & ".join("".join(_ESCAPED.get(sign, sign) for sign in cell) for cell in cells) + r" \\"

    before = ["", *(row["metric"] for row in rows)]
    shown = [{**row, "metric": ""} if row["metric"] == last else row for row, last in zip(rows, before, strict=False)]
    body = [line([*row.values()]) for row in shown]
    head = rf"\begin{{tabular}}{{ll{'r' * (len(rows[0]) - 2)}}}"
    return "\n".join([head, r"\toprule", line([*rows[0]]), r"\midrule", *body, r"\bottomrule", r"\end{tabular}", ""])


def write_comparison_page(
    campaigns: Mapping[str, Results], table: DataFrame, out: Path, units: UnitSystem, command: str
) -> None:
    """Write the page of a comparison of ``campaigns``, by label, to the HTML file ``out``; ``command`` repeats it.

    Raises:
        CampaignError: The file cannot be written.
    """
    metrics = [name for name in dict.fromkeys(table["metric"]) if name != ENDED]
    first = next(iter(campaigns))
    page = render(
        "comparison.html.j2",
        campaigns=campaigns,
        rows={system: comparison_rows(table, system) for system in UnitSystem},
        dropped=dropped(table, first),
        first=first,
        curves={system: inline_svg(partial(campaign_figure, campaigns, system, metrics)) for system in UnitSystem},
        units=units,
        sections={"summary": "Summary", "curves": "Distributions", "repeat": "Repeat"},
        command=command,
    )
    write_page(page, out, CampaignError)

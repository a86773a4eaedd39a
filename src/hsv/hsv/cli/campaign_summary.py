"""The summary of a campaign: on the terminal, as JSON, as a page."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from hsv.campaign.page import write_page
from hsv.campaign.run import Capacity
from hsv.campaign.summary import (
    CONFIDENCE,
    ENDED,
    Distribution,
    Results,
    Share,
    WorstFlight,
    distributions,
    shares,
    worst_flights,
)
from hsv.campaign.table import OUTCOMES
from hsv.cli.output import Units, console, errors, print_json, shown, to_json

_LISTED = 5
"""Worst flights that are listed; the page has more."""


def announce(capacity: Capacity) -> None:
    """Say what a campaign is going to take."""
    hours, minutes = divmod(capacity.wall_time / 60.0, 60.0)
    duration = f"{hours:.0f} h {minutes:.0f} min" if hours else f"{capacity.wall_time:.0f} s"
    errors.print(
        f"{capacity.flights} flights on {capacity.cores} cores: about {duration} "
        f"({capacity.wall_time * capacity.cores / 3600.0:.2g} core hours), {capacity.bytes / 1e6:.2g} MB on the disk"
    )


def show(results: Results, units: Units, json: bool, page: bool, flown: int | None = None) -> None:
    """Print the summary of a campaign and write its page; ``flown`` now, if any were."""
    written = results.path.with_suffix(".html") if page else None
    rows, worst, spread = shares(results), worst_flights(results, _LISTED), distributions(results)
    if json:
        print_json(
            {
                "result": str(results.path),
                "page": str(written) if written else None,
                "scenario": results.campaign.scenario_name,
                "method": results.campaign.method,
                "flights": results.campaign.samples,
                "flown_now": flown,
                "confidence": CONFIDENCE,
                "limits": [
                    {
                        "name": share.name,
                        "limit_si": share.limit,
                        "within": share.within,
                        "fraction": share.fraction,
                        "interval": share.interval,
                    }
                    for share in rows
                ],
                "distributions": {
                    d.name: {
                        statistic: to_json({statistic: (getattr(d, statistic), d.unit)}, units).popitem()[1]
                        for statistic in ("minimum", "median", "percentile_95", "maximum", "mean")
                    }
                    | {"unit": shown((1.0, d.unit), units)[1], "flights": d.flights}
                    for d in spread
                },
                "worst_flights": [
                    {"flight": w.flight, "limit": w.limit, "of_limit": w.ratio, "sample_si": w.sample} for w in worst
                ],
            }
        )
    else:
        _print_tables(results, rows, worst, spread, units)
        console.print(f"results {results.path}", soft_wrap=True, markup=False)
    if written:
        write_page(results, written)
    if written and not json:
        console.print(f"page    {written}", soft_wrap=True, markup=False)


def _print_tables(
    results: Results, rows: Sequence[Share], worst: Sequence[WorstFlight], spread: Sequence[Distribution], units: Units
) -> None:
    def number(value: float, unit: str) -> str:
        return f"{shown((value, unit), units)[0]:.5g}"

    campaign = results.campaign
    table = Table(title=f"{campaign.scenario.title}: {campaign.samples} flights", title_justify="left", box=None)
    for heading in ("limit", "", "within", "share", "95 % interval"):
        table.add_column(heading, justify="left" if heading == "limit" else "right")
    for share in rows:
        unit = OUTCOMES.get(share.name, "1")
        limit = (
            ""
            if share.limit is None
            else f"{number(share.limit, unit)} {shown((1.0, unit), units)[1]}".removesuffix(" 1")
        )
        interval = "all corners" if share.interval is None else " to ".join(f"{100 * p:.2f} %" for p in share.interval)
        table.add_row(
            share.name.replace("_", " "),
            limit,
            f"{share.within} of {share.flights}",
            f"{100 * share.fraction:.2f} %",
            interval,
        )
    console.print(table)
    table = Table(box=None)
    for heading in ("metric", "least", "median", "95 %", "largest", "unit"):
        table.add_column(heading, justify="left" if heading in ("metric", "unit") else "right")
    for d in spread:
        values = (number(v, d.unit) for v in (d.minimum, d.median, d.percentile_95, d.maximum))
        table.add_row(d.name.replace("_", " "), *values, shown((1.0, d.unit), units)[1].removesuffix("1"))
    console.print(table)
    worst = [w for w in worst if w.limit]  # of a scenario without limits, those that ended early
    if worst:
        console.print("worst flights, by what they use of their limits:")
    for w in worst:
        used = w.limit if w.limit in ENDED else f"{100 * w.ratio:.0f} % of {w.limit.replace('_', ' ')}"
        console.print(f"  {w.flight}: {used}; {sample_words(w.sample)}", soft_wrap=True)


def sample_words(sample: dict[str, float]) -> str:
    """Return a sample (SI) on one line."""
    return ", ".join(f"{name} {value:+.4g}" for name, value in sample.items())

"""The summary of a campaign: on the terminal, as JSON, as a page."""

from __future__ import annotations

from collections.abc import Sequence

from hsv.base.units import UnitSystem, in_system, significant, unit_in
from hsv.cli.output import console, errors, folded, json_system, new_table, print_json
from hsv.flight.campaign.capacity import Capacity
from hsv.flight.campaign.summary import (
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
from hsv.flight.campaign.table import OUTCOMES
from hsv.flight.metrics import in_words, is_share
from hsv.model.vehicle_parameters import COEFFICIENT_UNITS
from hsv.pages.campaign.page import write_page

_LISTED = 5
"""Worst flights that are listed; the page has more."""


def announce(capacity: Capacity) -> None:
    """Print the expected size and duration of a campaign."""
    hours, minutes = divmod(capacity.wall_time / 60.0, 60.0)
    duration = f"{hours:.0f} h {minutes:.0f} min" if hours else f"{significant(capacity.wall_time, 2)} s"
    cores = "core" if capacity.cores == 1 else "cores"
    errors.print(
        f"{capacity.flights} flights on {capacity.cores} {cores}: about {duration} "
        f"({significant(capacity.wall_time * capacity.cores / 3600.0, 2)} core hours), "
        f"{significant(capacity.bytes / 1e6, 2)} MB of disk space"
    )


def show(results: Results, units: UnitSystem, json: bool, page: bool, flown: int | None = None) -> None:
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
                        statistic: in_system(getattr(d, statistic), d.unit, json_system(units))[0]
                        for statistic in ("minimum", "median", "percentile_95", "maximum", "mean")
                    }
                    | {"unit": unit_in(json_system(units), d.unit), "flights": d.flights}
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
    results: Results,
    rows: Sequence[Share],
    worst: Sequence[WorstFlight],
    spread: Sequence[Distribution],
    units: UnitSystem,
) -> None:
    campaign = results.campaign
    headings = ("limit", "", "within", "share", "95 % interval")
    title = f"{campaign.scenario.title}: {campaign.samples} flights"
    table = new_table(*headings, title=title, right=headings[1:])
    for share in rows:
        limit = "" if share.limit is None else " ".join(_outcome(share.name, share.limit, units)).strip()
        interval = "all corners" if share.interval is None else " to ".join(_percent(p) for p in share.interval)
        table.add_row(
            in_words(share.name),
            limit,
            f"{share.within} of {share.flights}",
            _percent(share.fraction),
            interval,
        )
    console.print(table)
    numbers = ("least", "median", "95 %", "largest")
    table = new_table("metric", *numbers, "unit", right=numbers)
    for d in spread:
        cells = [_outcome(d.name, v, units) for v in (d.minimum, d.median, d.percentile_95, d.maximum)]
        table.add_row(in_words(d.name), *(number for number, _ in cells), cells[0][1])
    console.print(table)
    worst = [w for w in worst if w.limit]  # of a scenario without limits, those that ended early
    if worst:
        console.print("worst flights, by the fraction of their limits that they use:")
    for w in worst:
        used = w.limit if w.limit in ENDED else f"{100 * w.ratio:.0f} % of {in_words(w.limit)}"
        console.print(folded(f"{w.flight}: {used}; {sample_words(w.sample, units)}", 4, first=2), soft_wrap=True)


def sample_words(sample: dict[str, float], units: UnitSystem) -> str:
    """Return a sample (SI; uncertain parameters are relative changes) on one line."""
    return ", ".join(
        f"{name} {100.0 * value:+.3g} %"
        if units is UnitSystem.metric and name in COEFFICIENT_UNITS
        else f"{name} {value:+.3g}"
        for name, value in sample.items()
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _outcome(name: str, value: float, units: UnitSystem) -> tuple[str, str]:
    """Return a number that is kept of a flight (SI) as it is printed, and its unit."""
    number, unit = in_system(value, OUTCOMES.get(name, "1"), units, share=is_share(name))
    return significant(number), "" if unit == "1" else unit

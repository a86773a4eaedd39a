"""The page of a Monte Carlo campaign: a self-contained HTML file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
from markupsafe import Markup

from hsv.base.errors import CampaignError, ControllerError
from hsv.base.units import UnitSystem
from hsv.flight.campaign.campaign import SEARCHES, Factor
from hsv.flight.campaign.envelope import SIGNALS, signals, window_starts
from hsv.flight.campaign.sample_runner import OUTCOMES
from hsv.flight.campaign.summary import (
    ENDED,
    Distribution,
    Results,
    Share,
    distributions,
    limits,
    points,
    required,
    shares,
    within_all,
    worst_flights,
)
from hsv.flight.flight import Flight
from hsv.flight.limits import missed
from hsv.flight.metrics import Group, is_share, metric_of, spaced
from hsv.flight.search.rows import recorded_badness
from hsv.model.plant import Plant
from hsv.pages.engine import Numbers, Plot, render, write_page
from hsv.pages.picture import Picture, picture
from hsv.pages.search import search_section
from hsv.pages.text import capitalised, quantity, units_of

POINTS = 2000
"""Maximum number of flights in a scatter plot; with more flights, every n-th is shown."""

BINS = 60
"""Maximum number of bars of a histogram."""

RUN = "run"
"""Group of the outcomes that are not metrics: end time and largest tube level."""

PICTURED = ("altitude_error", "velocity_error", "angle_of_attack", "elevator_deflection")
"""Signals of the picture of all flights."""

SECTIONS = {
    "search": "Search",
    "summary": "Summary",
    "worst": "Worst flights",
    "envelopes": "Envelopes",
    "distributions": "Distributions",
    "scatter": "Against each parameter",
    "repeat": "Repeat",
}
"""Headings in the order of the page."""


def write_campaign_page(results: Results, out: Path, units: UnitSystem = UnitSystem.metric) -> None:
    """Write the page of ``results`` to the HTML file ``out``; ``units`` are its initial units.

    Raises:
        CampaignError: The file cannot be written.
    """
    write_page(campaign_page(results, units), out, CampaignError)


def campaign_page(results: Results, units: UnitSystem = UnitSystem.metric) -> str:
    """Return the HTML page of a campaign; ``units`` are its initial units."""
    searched = results.campaign.method in SEARCHES
    worst = worst_flights(results, badness=recorded_badness(results) if searched else None)
    shown, judged = distributions(results), shares(results)
    flights = _repeated(results, worst[0].flight)
    differing = [d for d in shown if d.minimum < d.maximum]
    varied = [d.name for d in differing]
    lost = results.campaign.samples - int(results.finished.sum())
    grouped = _grouped(differing)
    numbers = Numbers()
    drawn = np.arange(0, results.campaign.samples, -(-results.campaign.samples // POINTS))
    end = _windows(results)[-1]
    failed = most_failed(judged)
    envelopes = _envelopes(results, flights, numbers)
    pictured = [plot for name in PICTURED for plot in envelopes if plot.name == f"envelope_{name}"]
    factors = sorted(results.campaign.factors, key=lambda factor: (not factor.values, factor.is_perturbation))
    starts = [fault.start for fault in results.campaign.scenario.fault]
    shades = [(start, end) for start in starts if start < end]
    search = search_section(results, numbers) if searched else None
    absent = [name for name, there in (("scatter", differing), ("search", search)) if not there]
    return render(
        "campaign.html.j2",
        plots=[
            *envelopes,
            *(_histogram(results, d, numbers) for found in grouped.values() for d in found),
            *(_scatter(results, factor, drawn, numbers) for factor in factors if differing),
        ],
        described={
            "runs": [{"label": label, "end": end} for label in flights],
            "metrics": {
                d.name: {
                    "title": spaced(d.name),
                    "units": units_of(OUTCOMES.get(d.name, "1"), share=is_share(d.name)),
                    "y": numbers.add(np.where(results.finished, results.column(d.name), np.nan)[drawn]),
                    "limits": _limits(results, d),
                }
                for d in differing
            },
        },
        numbers=numbers,
        campaign=results.campaign,
        units=units,
        sections={name: heading for name, heading in SECTIONS.items() if name not in absent},
        search=search,
        sentence=sentence(results),
        factors=factors,
        points=points(results),
        survival=_survival(results) if len(results.campaign.grid) == 1 else {},
        failed=failed and spaced(failed.name),
        lost=lost,
        sorted=failed and _sorted(results, failed, numbers),
        picture=picture(pictured, numbers, end, shades),
        result=results.path.name,
        shares=judged,
        good=within_all(results) == results.campaign.samples and not missed(results.disk_margin),
        flights=list(flights),
        distributions=grouped,
        constant=[d for d in shown if d.minimum == d.maximum],
        outcome=_outcome,
        worst=worst,
        chosen=next((name for name in (results.campaign.goal, worst[0].limit, *varied) if name in varied), ""),
        ended=ENDED,
        relative=relative,
        share_interval=share_interval,
        drawn=len(drawn),
    )


def sentence(results: Results) -> str:
    """Return the verdict: how many flights keep all limits, which limit most of them break, how many are lost."""
    ended, *limited = judged = shares(results)
    lost = ended.flights - ended.within
    ending = f"{lost} of {ended.flights} flights are lost" if lost else "All flights reached the end"
    margin = f" {capitalised(results.disk_margin['words'])}." if results.disk_margin else ""
    limited = [share for share in limited if share.flights]
    if not limited:
        return f"{ending}; there are no limits to judge them by.{margin}"
    named = "limits and requirements" if required(results) else "limits"
    bounds = f"all {len(limited)} {named}" if len(limited) > 1 else "the limit"
    text = f"{within_all(results)} of {ended.flights} flights are within {bounds}"
    if failed := most_failed(judged):
        broken = f"{failed.flights - failed.within} of {failed.flights}{' that reached the end' if lost else ''}"
        alike = [s for s in limited if s.flights - s.within == failed.flights - failed.within]
        names = ", ".join(spaced(share.name) for share in alike)
        text += f"; the limit{'s' * (len(alike) > 1)} that most flights break: {names} ({broken})"
    return f"{text}. {ending}.{margin}"


def most_failed(judged: Sequence[Share]) -> Share | None:
    """Return the limit that most of the judged flights break, or None if no finished flight breaks any."""
    limited = (share for share in judged if share.limit is not None)
    over = max(limited, key=lambda share: share.flights - share.within, default=None)
    return over if over is not None and over.within < over.flights else None


def _sorted(results: Results, failed: Share, numbers: Numbers) -> Picture:
    """Return the picture of the ``failed`` limit: the limit, and the sorted magnitudes of its metric in its flights."""
    values = results.column(failed.name)[results.finished]
    values = values if failed.name in required(results) else np.abs(values)
    values = np.sort(values)[: failed.flights]  # times that were not reached come last, as NaN
    across = 100.0 * (np.arange(len(values)) + 0.5) / len(values)
    limit = "bound", None, np.array([0.0, 100.0]), np.full(2, failed.limit)
    lines = (limit, ("actual", 0, across, values))
    curves = [{"kind": kind, "run": run, "x": numbers.add(x), "y": numbers.add(y)} for kind, run, x, y in lines]
    title = capitalised(spaced(failed.name)) + ("" if failed.name in required(results) else ", magnitude")
    plot = Plot("sorted", title, OUTCOMES.get(failed.name, "1"), "", curves, share=is_share(failed.name))
    return picture([plot], numbers, 100.0, axis="flights, in order of magnitude [%]")


def _grouped(shown: Sequence[Distribution]) -> dict[str, list[Distribution]]:
    """Return the distributions by group: metrics by their groups, then end time and tube level under :data:`RUN`."""
    groups: dict[str, list[Distribution]] = {group: [] for group in (*Group, RUN)}
    for distribution in shown:
        groups[_group(distribution.name)].append(distribution)
    return {group: found for group, found in groups.items() if found}


def _group(name: str) -> str:
    return RUN if name in ("end_time", "tube_level") else metric_of(name).group


def _outcome(name: str, value: float, digits: int = 3) -> Markup:
    """Return the ``value`` (SI) of the metric, end time or tube level ``name`` as HTML in all systems of units."""
    if math.isinf(value):
        return Markup("not reached")
    return quantity(value, OUTCOMES.get(name, "1"), digits, share=is_share(name))


def share_interval(share: Share) -> str:
    """Return the confidence interval of a share in percent, with the digits that the number of flights resolves."""
    assert share.interval is not None
    places = max(0, math.ceil(math.log10(share.flights)) - 2)
    low, high = (f"{100.0 * end:.{places}f}" for end in share.interval)
    return f"{low} … {high} %"


def relative(factor: Factor) -> bool:
    """Return whether a factor is the relative change of a parameter, displayed in percent."""
    return factor.field != factor.name and factor.unit == "1"


def histogram(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return counts, shape (b,), and edges, shape (b + 1,), of a histogram of the finite ``values``; b <= ``BINS``."""
    values = values[np.isfinite(values)]
    distinct = np.unique(values.round(9))
    bins: int | np.ndarray = min(BINS, max(10, 2 * round(np.sqrt(len(values)))))
    if 1 < len(distinct) <= BINS:
        # Times (multiples of the control period) and counts (integers) have one bar per value.
        spacing = float(np.min(np.diff(distinct)))
        bars = round((distinct[-1] - distinct[0]) / spacing) + 1
        bins = distinct[0] + spacing * (np.arange(bars + 1) - 0.5) if bars <= BINS else bins
    counts, edges = np.histogram(values, bins)
    return counts, edges


def _survival(results: Results) -> dict[UnitSystem, Markup]:
    """Return the share of the flights that reach the end over the swept factor as SVG, by unit system."""
    # Imported here, because matplotlib takes longer to load than the rest of the page to write.
    from hsv.pages.campaign_plots import SURVIVAL, campaign_figure
    from hsv.pages.plots import Layout, inline_svg

    named, layout = {results.path.stem: results}, Layout(size=(7.0, 2.5))
    return {u: inline_svg(partial(campaign_figure, named, u, [SURVIVAL], layout)) for u in UnitSystem}


def _repeated(results: Results, worst: int) -> dict[str, Flight]:
    """Repeat two flights, the unchanged scenario and number ``worst``; return by name those that could be flown."""
    flights = {}
    if results.flyable:
        runner = results.sample_runner
        with suppress(ControllerError):
            flights["nominal vehicle"] = runner.fly_unchanged()
        with suppress(ControllerError):
            flights[f"flight {worst}"] = runner.fly(worst, [*results.sample(worst).values()])
    return flights


def _windows(results: Results) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return first step and time (s) of each time window, the indices of windows with data, and the planned end (s)."""
    campaign = results.campaign
    plant = Plant.from_parameters({**campaign.design, **campaign.scenario.parameters()})
    reached = np.flatnonzero(np.isfinite(results.envelope.low).all(axis=1))
    starts = window_starts(plant.steps)
    return starts, starts * plant.period, reached, plant.steps * plant.period


def _envelopes(results: Results, flights: Mapping[str, Flight], numbers: Numbers) -> list[Plot]:
    """Return a plot of each signal: range and mean of all flights, and the repeated ``flights``."""
    envelope, found = results.envelope, []
    windows, time, reached, _ = _windows(results)
    x, flight_x = numbers.add(time[reached]), numbers.add(time)
    for index, (name, unit) in enumerate(SIGNALS):
        if name.startswith("elastic") and not (
            envelope.low[reached, index].any() or envelope.high[reached, index].any()
        ):
            continue  # a rigid vehicle has no elastic states
        curves = [
            {"kind": kind, "label": label, "run": None, "x": x, "y": numbers.add(values[reached, index])}
            for kind, label, values in (
                ("low", "smallest", envelope.low),
                ("high", "largest", envelope.high),
                ("mean", "mean", envelope.mean),
            )
        ]
        for run, flight in enumerate(flights.values()):
            y = numbers.add(_curve(flight, windows, index))
            curves.append({"kind": "nominal" if run else "actual", "label": "", "run": run, "x": flight_x, "y": y})
        found.append(Plot(f"envelope_{name}", capitalised(spaced(name)), unit, "envelopes", curves))
    return found


def _histogram(results: Results, shown: Distribution, numbers: Numbers) -> Plot:
    """Return the histogram of a metric, end time or tube level, with the limits inside the range of the data."""
    values = results.column(shown.name)[results.finished]
    counts, edges = histogram(values)
    x, y = numbers.add(0.5 * (edges[:-1] + edges[1:])), numbers.add(counts)
    note = Markup("{}median {}, 95 % below {}, largest {}").format(
        "magnitude: " if shown.title.startswith("|") else "",
        *(_outcome(shown.name, value) for value in (shown.median, shown.percentile_95, shown.maximum)),
    )
    return Plot(
        f"histogram_{shown.name}",
        capitalised(spaced(shown.name)),
        "1",
        f"distributions_{_group(shown.name)}",
        [{"kind": "bars", "label": "flights", "run": None, "x": x, "y": y}],
        limits=_limits(results, shown),
        notes=[note, *([Markup(f"not reached in {shown.not_reached} flights")] if shown.not_reached else [])],
        x_unit=OUTCOMES.get(shown.name, "1"),
        x_share=is_share(shown.name),
        limits_on="x",
    )


def _scatter(results: Results, factor: Factor, drawn: np.ndarray, numbers: Numbers) -> Plot:
    """Return the scatter plot of a metric against a factor; the script of the page fills in the chosen metric."""
    x, every = numbers.add(results.column(f"sample_{factor.name}")[drawn]), int(drawn[1]) if len(drawn) > 1 else 1
    curve = {"kind": "dots", "label": "", "run": None, "x": x, "y": x, "every": every}
    title, share = capitalised(spaced(factor.name)), relative(factor)
    return Plot(f"scatter_{factor.name}", title, "1", "scatter", [curve], x_unit=factor.unit, x_share=share)


def _limits(results: Results, shown: Distribution) -> list[float]:
    """Return minus and plus the limit (SI) of a metric, each only if it lies within the range of the data."""
    limit = 0.0 if shown.name in required(results) else limits(results).get(shown.name)
    values = results.column(shown.name)[results.finished]
    low, high = np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf)
    return [] if limit is None else [end for end in {-limit, limit} if low <= end <= high]


def _curve(flight: Flight, windows: np.ndarray, index: int) -> np.ndarray:
    """Return signal number ``index`` of a flight at the first step of each window that the flight has reached."""
    curve = signals(flight)[index]
    return np.asarray(curve[windows[windows < len(curve)]])

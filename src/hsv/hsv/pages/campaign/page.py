"""The results of a campaign as one HTML page that asks nothing of the network."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from hsv.base.errors import CampaignError, ControllerError, reason
from hsv.base.units import UnitSystem
from hsv.flight.campaign.campaign import Factor
from hsv.flight.campaign.envelope import SIGNALS, signals, window_starts
from hsv.flight.campaign.summary import (
    ENDED,
    Distribution,
    Results,
    Share,
    distributions,
    limits,
    shares,
    within_all,
    worst_flights,
)
from hsv.flight.campaign.table import OUTCOMES
from hsv.flight.flight import Flight
from hsv.flight.metrics import METRICS, Group, in_words, is_share
from hsv.model.plant import Plant
from hsv.pages.report.payload import Numbers, compressed
from hsv.pages.report.picture import Band, Line, Picture, picture, time_plot
from hsv.pages.report.templates import LIBRARY, environment_of
from hsv.pages.report.text import capitalised, in_brackets, quantity, units_of

POINTS = 2000
"""Flights that scatter plots draw at most, of more every n-th; WebGL would draw more, in fewer plots a page."""

BINS = 60

RUN = "run"
"""Group of the numbers that are not metrics: when a flight ended, and its largest level in the tube."""


PICTURED = ("altitude_error", "velocity_error", "angle_of_attack", "elevator_deflection")
"""Signals that the picture is made of."""

SECTIONS = {
    "summary": "Summary",
    "worst": "Worst flights",
    "envelopes": "Envelopes",
    "distributions": "Distributions",
    "scatter": "Against each parameter",
    "repeat": "Repeat",
}
"""Headings in the order of the page."""


def write_page(results: Results, out: Path, units: UnitSystem = UnitSystem.metric) -> None:
    """Write the page of ``results`` to the HTML file ``out``; ``units`` are those in which it opens.

    Raises:
        CampaignError: The file cannot be written.
    """
    page = render(results, units)
    try:
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        if out.is_file():
            out.unlink()  # half a page
        raise CampaignError(f"{out}: cannot be written ({reason(error)}), expected an HTML file to write") from error


def render(results: Results, units: UnitSystem = UnitSystem.metric) -> str:
    """Return the page."""
    environment = environment_of("hsv.pages.campaign")
    worst = worst_flights(results)
    shown = distributions(results)
    flights = _flown(results, worst[0].flight)
    plots, numbers = _plots(results, flights)
    differing = [d for d in shown if d.minimum < d.maximum]
    return environment.get_template("page.html.j2").render(
        campaign=results.campaign,
        units=units,
        sections={name: heading for name, heading in SECTIONS.items() if differing or name != "scatter"},
        sentence=sentence(results),
        picture=_picture(results, flights),
        title=results.campaign.scenario.title,
        result=results.path.name,
        shares=shares(results),
        within_all=within_all(results),
        flights=list(flights),
        distributions=_grouped(differing),
        constant=[d for d in shown if d.minimum == d.maximum],
        outcome=_outcome,
        outcome_unit=lambda name: in_brackets(OUTCOMES[name], share=is_share(name)),
        worst=worst,
        chosen=next((d.name for d in differing if d.name == worst[0].limit), differing[0].name if differing else ""),
        ended=ENDED,
        relative=relative,
        share_interval=share_interval,
        flown_again=results.flyable,
        points=POINTS,
        drawn=len(_drawn(results)),
        signals=SIGNALS,
        plots=plots,
        numbers=Markup(numbers),
        data=_data(results, [d.name for d in differing]),
        library=Markup(compressed(LIBRARY.read_bytes())),
    )


def sentence(results: Results) -> str:
    """Return the verdict: how many flights are within all limits, and which limit most of them break."""
    ended, *limited = shares(results)
    lost = ended.flights - ended.within
    said = f"{lost} of {ended.flights} flights did not come to their end" if lost else "All flights came to their end"
    if not limited:
        return f"{said}; there are no limits to judge them by."
    text = f"{within_all(results)} of {ended.flights} flights are within all {len(limited)} limits"
    over = min(limited, key=lambda share: share.within)
    if broken := ended.flights - over.within:
        text += f"; most often not kept is the limit of {in_words(over.name)}, by {broken} of {ended.flights}"
    return f"{text}. {said}."


def _grouped(shown: Sequence[Distribution]) -> dict[str, list[Distribution]]:
    """Return distributions by what they tell about: the groups of metrics, then the run."""
    groups: dict[str, list[Distribution]] = {group: [] for group in (*Group, RUN)}
    for distribution in shown:
        groups[METRICS[distribution.name].group if distribution.name in METRICS else RUN].append(distribution)
    return {group: found for group, found in groups.items() if found}


def _outcome(name: str, value: float, digits: int = 3) -> Markup:
    """Return a number (SI) that is kept of a flight under ``name``, in all systems of units."""
    return quantity(value, OUTCOMES[name], digits, share=is_share(name))


def share_interval(share: Share) -> str:
    """Return the interval of a share in percent, in as many digits as the number of flights can tell apart."""
    assert share.interval is not None
    places = max(0, math.ceil(math.log10(share.flights)) - 2)
    low, high = (f"{100.0 * end:.{places}f}" for end in share.interval)
    return f"{low} … {high} %"


def relative(factor: Factor) -> bool:
    """Return whether a factor is the relative change of a parameter, which people read in percent."""
    return factor.field != factor.name and factor.unit == "1"


def _data(results: Results, names: Sequence[str]) -> dict[str, Any]:
    """Return what the page's script draws besides curves over time, as plain data."""
    drawn = _drawn(results)
    columns = {name: results.column(name) for name in names}
    stated = limits(results)
    return {
        "metrics": {
            name: {
                "words": in_words(name),
                "units": units_of(OUTCOMES[name], share=is_share(name)),
                "limit": stated.get(name),
                "values": _packed(values[drawn]),
                **histogram(values),
            }
            for name, values in columns.items()
        },
        "factors": [
            {
                "name": factor.name,
                "units": units_of(factor.unit, share=relative(factor)),
                "values": _packed(results.column(f"sample_{factor.name}")[drawn]),
            }
            for factor in results.campaign.factors
        ],
        "flights": _packed(drawn),
    }


def _drawn(results: Results) -> np.ndarray:
    n = results.campaign.samples
    return np.arange(0, n, -(-n // POINTS))


def histogram(values: np.ndarray) -> dict[str, list[float]]:
    """Return counts and edges of at most :data:`BINS` bars over the finite ``values``."""
    values = values[np.isfinite(values)]
    distinct = np.unique(values.round(9))
    bins: int | np.ndarray = min(BINS, max(10, 2 * round(np.sqrt(len(values)))))
    if 1 < len(distinct) <= BINS:
        # Times are whole control periods and counts whole numbers: a bar for each, not a comb.
        spacing = float(np.min(np.diff(distinct)))
        bars = round((distinct[-1] - distinct[0]) / spacing) + 1
        bins = distinct[0] + spacing * (np.arange(bars + 1) - 0.5) if bars <= BINS else bins
    counts, edges = np.histogram(values, bins)
    return {"counts": counts.tolist(), "edges": edges.tolist()}


def _flown(results: Results, worst: int) -> dict[str, Flight]:
    """Return the flight of the unchanged scenario and the worst one, if they may be flown, by their names."""
    flights = {}
    if results.flyable:
        runner = results.sample_runner
        with suppress(ControllerError):
            flights["unchanged"] = runner.fly_unchanged()
        with suppress(ControllerError):
            flights[f"flight {worst}"] = runner.fly(worst, runner.sample(worst))
    return flights


def _windows(results: Results) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return the first step of each window, its time (s), which windows any flight reached, and the end (s)."""
    campaign = results.campaign
    plant = Plant.from_parameters({**campaign.design, **campaign.scenario.parameters()})
    reached = np.flatnonzero(np.isfinite(results.envelope.low).all(axis=1))
    starts = window_starts(plant.steps)
    return starts, starts * plant.period, reached, plant.steps * plant.period


def _plots(results: Results, flights: Mapping[str, Flight]) -> tuple[dict[str, Any], str]:
    """Return the description of the curves over time as that of the report, and the numbers they draw, compressed."""
    envelope, numbers = results.envelope, Numbers()
    windows, time, reached, end = _windows(results)
    x, flown_x = numbers.add(time[reached]), numbers.add(time)

    def panel(index: int, name: str, unit: str) -> dict[str, Any]:
        of_all = {"low": envelope.low, "high": envelope.high, "mean": envelope.mean}
        labels = {"low": "least", "high": "largest", "mean": "mean"}
        curves = [
            {"kind": kind, "label": labels[kind], "run": None, "x": x, "y": numbers.add(values[reached, index])}
            for kind, values in of_all.items()
        ]
        for run, flight in enumerate(flights.values()):
            y = numbers.add(_curve(flight, windows, index))
            curves.append({"kind": "nominal" if run else "actual", "label": "", "run": run, "x": flown_x, "y": y})
        return {"name": f"envelope_{name}", "units": units_of(unit), "curves": curves, "limits": [], "shades": []}

    described = {
        "panels": [panel(index, *signal) for index, signal in enumerate(SIGNALS)],
        "runs": [{"label": label, "end": end} for label in flights],
        "end": end,
    }
    return described | {"lengths": numbers.lengths}, numbers.packed()


def _picture(results: Results, flights: Mapping[str, Flight]) -> Picture:
    windows, time, reached, end = _windows(results)
    envelope = results.envelope
    plots = []
    for index, signal in enumerate(SIGNALS):
        if signal.name in PICTURED:
            lines = [Line("mean", time[reached], envelope.mean[reached, index])]
            for run, flight in enumerate(flights.values()):
                curve = _curve(flight, windows, index)
                look = f"run{run} nominal" if run else "run0"
                lines.append(Line(look, time[: len(curve)], curve, run))
            band = Band(time[reached], envelope.low[reached, index], envelope.high[reached, index])
            plots.append(time_plot(capitalised(in_words(signal.name)), signal.unit, end, lines, [band]))
    starts = [fault.start for fault in results.campaign.scenario.fault]
    return picture(plots, end, [(start, end) for start in starts if start < end])


def _curve(flight: Flight, windows: np.ndarray, index: int) -> np.ndarray:
    curve = signals(flight.data().flight_curves)[index]
    return np.asarray(curve[windows[windows < len(curve)]])


def _packed(values: np.ndarray) -> str:
    """Return numbers in single precision, as text."""
    with np.errstate(over="ignore"):
        return base64.b64encode(np.asarray(values, "<f4").tobytes()).decode()

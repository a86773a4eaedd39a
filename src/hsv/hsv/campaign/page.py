"""The results of a campaign as one HTML page that asks nothing of the network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from contextlib import suppress
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from hsv.campaign.envelope import SIGNALS, signals, window_starts
from hsv.campaign.summary import ENDED, Results, distributions, limits, shares, worst_flights
from hsv.errors import CampaignError, ControllerError, reason
from hsv.recording.report import text
from hsv.recording.report.page import LIBRARY
from hsv.recording.report.payload import compressed
from hsv.recording.report.templates import environment_of
from hsv.simulation.closed_loop import Flight
from hsv.vehicle.plant import Plant

POINTS = 2000
"""Flights that scatter plots draw at most, of more every n-th; WebGL would draw more, in fewer plots a page."""

BINS = 60


def write_page(results: Results, out: Path) -> None:
    """Write the page of ``results`` to the HTML file ``out``.

    Raises:
        CampaignError: The file cannot be written.
    """
    page = render(results)
    try:
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        if out.is_file():
            out.unlink()  # half a page
        raise CampaignError(f"{out}: cannot be written ({reason(error)}), expected an HTML file to write") from error


def render(results: Results) -> str:
    """Return the page."""
    environment = environment_of("hsv.campaign")
    worst = worst_flights(results)
    shown = distributions(results)
    return environment.get_template("page.html.j2").render(
        campaign=results.campaign,
        title=results.campaign.scenario.title,
        result=results.path.name,
        shares=shares(results),
        distributions=[d for d in shown if d.minimum < d.maximum],
        constant=[d for d in shown if d.minimum == d.maximum],
        units={d.name: d.unit for d in shown},
        worst=worst,
        ended=ENDED,
        flown_again=results.flyable,
        points=POINTS,
        drawn=len(_drawn(results)),
        signals=SIGNALS,
        quantity=text.quantity,
        style=_shared("style.css"),
        script=Markup(files("hsv.campaign").joinpath("template", "page.js").read_text(encoding="utf-8")),
        charts=_shared("charts.js"),
        data=_data(results, [d.name for d in shown if d.minimum < d.maximum], worst[0].flight),
        library=Markup(compressed(LIBRARY.read_bytes())),
    )


def _data(results: Results, names: Sequence[str], worst: int) -> dict[str, Any]:
    """Return what the page's script draws, as plain data."""
    drawn = _drawn(results)
    columns = {name: results.column(name) for name in names}
    stated, units = limits(results), {d.name: d.unit for d in distributions(results)}
    return {
        "metrics": {
            name: {
                "unit": units[name],
                "limit": stated.get(name),
                "values": _packed(values[drawn]),
                **histogram(values),
            }
            for name, values in columns.items()
        },
        "factors": [
            {
                "name": factor.name,
                "unit": factor.unit,
                "values": _packed(results.column(f"sample_{factor.name}")[drawn]),
            }
            for factor in results.campaign.factors
        ],
        "flights": _packed(drawn),
        "envelope": _envelope(results, worst),
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


def _envelope(results: Results, worst: int) -> dict[str, Any]:
    """Return the envelopes, with the flight of the unchanged scenario and the worst one, where they may be flown."""
    campaign, envelope = results.campaign, results.envelope
    plant = Plant.from_parameters({**campaign.design, **campaign.scenario.parameters()})
    windows = window_starts(plant.steps)
    reached = np.flatnonzero(np.isfinite(envelope.low).all(axis=1))
    time = windows[reached] * plant.period
    flights = {}
    if results.flyable:
        runner = results.sample_runner
        with suppress(ControllerError):
            flights["unchanged"] = runner.fly_unchanged()
        with suppress(ControllerError):
            flights[f"flight {worst}"] = runner.fly(worst, runner.sample(worst))
    return {
        "time": _packed(time),
        "signals": [
            {
                "name": signal.name,
                "unit": signal.unit,
                "low": _packed(envelope.low[reached, i]),
                "high": _packed(envelope.high[reached, i]),
                "mean": _packed(envelope.mean[reached, i]),
                "flights": [
                    {"label": label, "y": _packed(_curve(flight, windows, i))} for label, flight in flights.items()
                ],
            }
            for i, signal in enumerate(SIGNALS)
        ],
        "flight_time": _packed(windows * plant.period),
    }


def _curve(flight: Flight, windows: np.ndarray, index: int) -> np.ndarray:
    curve = signals(flight.data())[:, index]
    return np.asarray(curve[windows[windows < len(curve)]])


def _packed(values: np.ndarray) -> str:
    """Return numbers in single precision, as text."""
    with np.errstate(over="ignore"):
        return base64.b64encode(np.asarray(values, "<f4").tobytes()).decode()


def _shared(name: str) -> Markup:
    return Markup(files("hsv.recording.report").joinpath("template", name).read_text(encoding="utf-8"))

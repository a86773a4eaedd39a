"""Figures of campaigns for papers: survival over a swept factor, envelopes, distributions and scatter plots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hsv.base.errors import ParameterError
from hsv.base.units import UnitSystem, in_system
from hsv.flight.campaign.envelope import SIGNALS, window_starts
from hsv.flight.campaign.sample_runner import OUTCOMES, outcomes_of
from hsv.flight.campaign.summary import Results, limits, points, required, sizes, title_of
from hsv.flight.metrics import is_share, spaced
from hsv.model.plant import Plant
from hsv.pages.plots import DASHES, Layout, chosen_name, mathtext, outer_legend, panel_figure

SURVIVAL = "survival"
"""Panel of the share of the flights that reach the end over the swept factor, with its interval"""

OVER = " over "
"""Joins a metric and a factor in the name of a scatter plot"""

_SIGNALS = {signal.name: index for index, signal in enumerate(SIGNALS)}


def campaign_figure(
    campaigns: Mapping[str, Results], system: UnitSystem, panels: Sequence[str] = (), layout: Layout | None = None
) -> Figure:
    """Return a figure of one or several campaigns, by label.

    Panels are ``survival``; a signal for its envelope over the flights that reach the end; a metric for the share of
    all flights in which it is at most so large, which ends at the share that the flights reach; and ``METRIC over
    FACTOR`` for a scatter plot. By default, ``survival`` if a factor was swept, else the first four envelopes.

    Raises:
        ParameterError: A panel is unknown; the message names it.
    """
    first = next(iter(campaigns.values()))
    factors = [factor.name for factor in first.campaign.factors]
    metrics = [name for name in outcomes_of(first.campaign.scenario) if name != "end_time"]
    chosen = []
    for given in panels or ([SURVIVAL] if first.campaign.grid else [*_SIGNALS][:4]):
        name, over, factor = given.partition(OVER)
        known = metrics if over else [SURVIVAL, *_SIGNALS, *metrics]
        chosen.append((chosen_name(name, known), chosen_name(factor, factors) if over else ""))
    layout = layout or Layout()
    with panel_figure(len(chosen), layout, sharex=False) as (figure, axes):
        for axis, (name, factor) in zip(axes, chosen, strict=True):
            for (label, results), dashes in zip(campaigns.items(), cycle(DASHES), strict=False):
                if factor:
                    x, y = results.column(f"sample_{factor}"), sizes(results, name)
                    axis.plot(_shown(x, _unit(results, factor), system), _of(name, y, system), ".", ms=3, label=label)
                    axis.set_xlabel(_titled(factor, _unit(results, factor), system))
                elif name == SURVIVAL:
                    _survival(axis, results, system, label, dashes)
                elif name in _SIGNALS:
                    _envelope(axis, results, _SIGNALS[name], system, label, dashes)
                    axis.set_xlim(layout.start, min(layout.end, results.campaign.scenario.duration))
                else:
                    _distribution(axis, results, name, system, label, dashes)
            if factor or name in metrics:
                title = _titled(title_of(name), OUTCOMES.get(name, "1"), system, share=is_share(name))
                (axis.set_title(title, loc="left") if factor else axis.set_xlabel(title))
        if len(campaigns) > 1:
            outer_legend(figure, axes)
    return figure


def _survival(axis: Axes, results: Results, system: UnitSystem, label: str, dashes: object) -> None:
    grid = results.campaign.grid
    if len(grid) != 1:
        raise ParameterError(f"panels: {SURVIVAL!r}, expected one swept factor, {label} has {len(grid)}")
    swept = sorted(points(results), key=lambda point: point.values[grid[0].name])
    x = _shown(np.array([point.values[grid[0].name] for point in swept]), grid[0].unit, system)
    y = np.array([point.survived.fraction for point in swept])
    ends = np.array([point.survived.interval or (point.survived.fraction,) * 2 for point in swept]).T
    axis.errorbar(x, 100.0 * y, 100.0 * np.abs(ends - y), fmt="o", ms=3, lw=1.1, ls=dashes, capsize=2, label=label)
    axis.set(xlabel=_titled(grid[0].name, grid[0].unit, system), ylim=(-4, 104))
    axis.set_title("flights that reach the end [%], 95 % intervals", loc="left")


def _envelope(axis: Axes, results: Results, index: int, system: UnitSystem, label: str, dashes: object) -> None:
    campaign, envelope = results.campaign, results.envelope
    plant = Plant.from_parameters({**campaign.design, **campaign.scenario.parameters()})
    reached = np.isfinite(envelope.low[:, index])[: len(window_starts(plant.steps))]
    time, unit = window_starts(plant.steps)[reached] * plant.period, SIGNALS[index].unit
    low, high, mean = (
        _shown(each[: len(reached)][reached, index], unit, system)
        for each in (envelope.low, envelope.high, envelope.mean)
    )
    [line] = axis.plot(time, mean, ls=dashes, lw=1.1, label=label)
    axis.fill_between(time, low, high, color=line.get_color(), alpha=0.2, lw=0)
    axis.set_title(_titled(SIGNALS[index].name, unit, system), loc="left")
    axis.set_xlabel("time [s]")
    axis.margins(x=0)


def _distribution(axis: Axes, results: Results, name: str, system: UnitSystem, label: str, dashes: object) -> None:
    values = sizes(results, name)
    values = np.sort(values[np.isfinite(values)])
    share = 100.0 * np.arange(1, len(values) + 1) / results.campaign.samples
    axis.step(_of(name, values, system), share, where="post", ls=dashes, lw=1.1, label=label)
    limit = 0.0 if name in required(results) else limits(results).get(name)
    if limit is not None:
        ink = matplotlib.rcParams["text.color"]  # visible in a dark page, too
        axis.axvline(float(_of(name, np.array(limit), system)), color=ink, lw=0.8, ls=":")
    axis.set_title("flights up to this value [%]", loc="left")
    axis.set_ylim(0, 104)


def _unit(results: Results, factor: str) -> str:
    return next(each.unit for each in results.campaign.factors if each.name == factor)


def _shown(values: np.ndarray, unit: str, system: UnitSystem) -> np.ndarray:
    return values * in_system(1.0, unit, system)[0]


def _of(name: str, values: np.ndarray, system: UnitSystem) -> np.ndarray:
    return values * in_system(1.0, OUTCOMES.get(name, "1"), system, share=is_share(name))[0]


def _titled(name: str, unit: str, system: UnitSystem, *, share: bool = False) -> str:
    shown = in_system(1.0, unit, system, share=share)[1]
    return spaced(name) + ("" if shown == "1" else f" [{mathtext(shown)}]")

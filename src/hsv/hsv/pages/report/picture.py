"""The picture that a page opens with: a few curves over one time axis, drawn without script and plotting library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hsv.base.units import UnitSystem, in_system
from hsv.pages.report.text import number

BUCKETS = 400
"""Stretches of time of which a curve keeps its least and its largest value, so that no peak is lost."""

WIDTH, HEIGHT = 1000.0, 100.0
"""Size of the drawing of a plot; the page scales it."""


@dataclass(frozen=True)
class Line:
    """A curve over time (s), in SI; ``y`` (n) may contain NaN."""

    look: str
    """Classes of the page's style: ``run0``, ``nominal``, ``reference``, ``bound``."""
    time: np.ndarray
    y: np.ndarray
    run: int | None = None
    """The run that it belongs to, with which it is hidden."""


@dataclass(frozen=True)
class Band:
    """All between two curves over time (s), in SI."""

    time: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass(frozen=True)
class Tick:
    """A labelled place along an axis, percent of its length."""

    text: str
    at: float


@dataclass(frozen=True)
class Path:
    """A drawn curve: SVG path data in the box of :data:`WIDTH` and :data:`HEIGHT`."""

    look: str
    d: str
    run: int | None


@dataclass(frozen=True)
class TimePlot:
    """A quantity over time as the page draws it."""

    title: str
    unit: str
    paths: tuple[Path, ...]
    ticks: dict[str, tuple[Tick, ...]]
    """Ticks by system of units, from below."""


@dataclass(frozen=True)
class Picture:
    """Plots over one time axis; shades are stretches of it, percent."""

    plots: tuple[TimePlot, ...]
    time: tuple[Tick, ...]
    shades: tuple[tuple[float, float], ...]


def picture(plots: Sequence[TimePlot], end: float, shades: Sequence[tuple[float, float]] = ()) -> Picture:
    """Return the picture of ``plots``, all drawn over 0 ... ``end`` (s), with stretches of time shaded."""
    marked = tuple((100.0 * start / end, 100.0 * (stop - start) / end) for start, stop in shades)
    return Picture(tuple(plots), _ticks(0.0, end, 1.0, 8), marked)


def time_plot(title: str, unit: str, end: float, lines: Sequence[Line], bands: Sequence[Band] = ()) -> TimePlot:
    """Return the plot of a quantity of an SI ``unit`` over 0 ... ``end`` (s); its axis holds all that is finite."""
    values = [line.y for line in lines] + [edge for band in bands for edge in (band.low, band.high)]
    finite = np.concatenate([value[np.isfinite(value)] for value in values])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    margin = 0.06 * (high - low) or 1e-3 * abs(high) or 1e-6
    low, high = low - margin, high + margin

    def box(time: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack([WIDTH * time / end, HEIGHT * (high - y) / (high - low)], axis=1)

    paths = [
        Path("band", _path(box(np.r_[band.time, band.time[::-1]], np.r_[band.low, band.high[::-1]])) + "Z", None)
        for band in bands
    ]
    paths += [Path(line.look, _path(box(*_thinned(line.time, line.y))), line.run) for line in lines]
    ticks = {}
    for system in UnitSystem:
        scale, _ = in_system(1.0, unit, system)
        ticks[str(system)] = _ticks(low, high, scale, 4)
    return TimePlot(title, unit, tuple(paths), ticks)


def _thinned(time: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps of least and largest value of each stretch of time, in order, and the last step."""
    if len(y) <= 2 * BUCKETS:
        return time, y
    starts = np.linspace(0, len(y), BUCKETS, endpoint=False).astype(int)
    kept = {len(y) - 1}
    for first, over in zip(starts, [*starts[1:], len(y)], strict=True):
        stretch = y[first:over]
        if np.isfinite(stretch).any():
            kept |= {first + int(np.nanargmin(stretch)), first + int(np.nanargmax(stretch))}
    rows = sorted(kept)
    return time[rows], y[rows]


def _path(points: np.ndarray) -> str:
    """Return SVG path data through points (n, 2), interrupted where one is not finite."""
    parts, pen = [], "M"
    for x, y in points:
        if np.isfinite(y):
            parts.append(f"{pen}{x:.4g} {y:.4g}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)


def _ticks(low: float, high: float, scale: float, count: int) -> tuple[Tick, ...]:
    """Return about ``count`` round numbers of the unit that ``scale`` leads to, within ``low`` ... ``high``."""
    from matplotlib.ticker import MaxNLocator

    places = MaxNLocator(nbins=count, steps=[1, 2, 2.5, 5, 10]).tick_values(low * scale, high * scale)
    return tuple(
        Tick(number(round(place, 12), 7), 100.0 * (place / scale - low) / (high - low))
        for place in map(float, places)
        if low <= place / scale <= high
    )

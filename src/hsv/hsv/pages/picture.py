"""The picture that a page opens with: a few curves as SVG, visible before any script has run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.ticker import MaxNLocator

from hsv.base.units import UnitSystem, in_system
from hsv.pages.text import number

STRETCHES = 400
"""Number of intervals of the axis; a curve keeps its minimum and maximum in each, so that no peak is lost."""

WIDTH, HEIGHT = 1000.0, 100.0
"""Size of the drawing; the page scales it."""

Tick = tuple[str, float]
"""Label, and place along the axis in percent of its length."""


@dataclass(frozen=True)
class Line:
    """A curve y(x), both (n), in SI; y may contain NaN. With ``high`` (n) it is the area between the two."""

    look: str
    """Classes of the stylesheet: ``run0``, ``nominal``, ``reference``, ``bound``, ``mean``, ``band``."""
    x: np.ndarray
    y: np.ndarray
    run: int | None = None
    """The flight with which it is hidden."""
    high: np.ndarray | None = None


@dataclass(frozen=True)
class Drawing:
    """A quantity over the axis of a picture; a path has its look, its SVG data and its run."""

    title: str
    unit: str
    share: bool
    paths: list[tuple[str, str, int | None]]
    ticks: dict[str, list[Tick]]
    """Ticks by system of units, from below."""


@dataclass(frozen=True)
class Picture:
    """Drawings over one axis; a shade has its start and its width in percent."""

    drawings: Sequence[Drawing]
    axis: str
    ticks: list[Tick]
    shades: Sequence[tuple[float, float]] = ()


def picture(
    drawings: Sequence[Drawing], end: float, shades: Sequence[tuple[float, float]] = (), axis: str = "time [s]"
) -> Picture:
    """Return the picture of ``drawings``, all over 0 ... ``end``, with stretches of the axis shaded."""
    marked = [(100.0 * start / end, 100.0 * (stop - start) / end) for start, stop in shades]
    return Picture(drawings, axis, _ticks(0.0, end, 1.0, 8), marked)


def drawing(title: str, unit: str, end: float, lines: Sequence[Line], *, share: bool = False) -> Drawing:
    """Return a quantity of an SI ``unit`` over 0 ... ``end``; its axis holds all finite values."""
    edges = [edge for line in lines for edge in (line.y, line.high) if edge is not None]
    finite = np.concatenate([edge[np.isfinite(edge)] for edge in edges])
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    margin = 0.06 * (high - low) or 1e-3 * abs(high) or 1e-6
    low, high = low - margin, high + margin

    def path(x: np.ndarray, y: np.ndarray) -> str:
        return _path(WIDTH * x / end, HEIGHT * (high - y) / (high - low))

    paths = []
    for line in lines:
        if line.high is None:
            d = path(*_thinned(line.x, line.y))
        else:
            d = path(np.r_[line.x, line.x[::-1]], np.r_[line.y, line.high[::-1]]) + "Z"
        paths.append((line.look, d, line.run))
    scales = {str(system): in_system(1.0, unit, system, share=share)[0] for system in UnitSystem}
    ticks = {system: _ticks(low, high, scale, 4) for system, scale in scales.items()}
    return Drawing(title, unit, share, paths, ticks)


def _thinned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of smallest and largest value of each stretch, in order, and both ends."""
    if len(y) <= 2 * STRETCHES:
        return x, y
    kept = {0, len(y) - 1}
    for rows in np.array_split(np.arange(len(y)), STRETCHES):
        if np.isfinite(y[rows]).any():
            kept |= {int(rows[np.nanargmin(y[rows])]), int(rows[np.nanargmax(y[rows])])}
    found = sorted(kept)
    return x[found], y[found]


def _path(across: np.ndarray, down: np.ndarray) -> str:
    """Return SVG path data through points, interrupted where one is not finite."""
    parts, pen = [], "M"
    for x, y in zip(across, down, strict=True):
        if np.isfinite(y):
            parts.append(f"{pen}{x:.4g} {y:.4g}")
        pen = "L" if np.isfinite(y) else "M"
    return "".join(parts)


def _ticks(low: float, high: float, scale: float, count: int) -> list[Tick]:
    """Return about ``count`` round numbers of the unit that ``scale`` leads to, within ``low`` ... ``high``."""
    places = MaxNLocator(nbins=count, steps=[1, 2, 2.5, 5, 10]).tick_values(low * scale, high * scale)
    inside = [float(place) for place in places if low <= place / scale <= high]
    return [(number(round(place, 12), 7), 100.0 * (place / scale - low) / (high - low)) for place in inside]

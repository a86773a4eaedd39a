"""The picture at the top of a page: a few of its plots as SVG, visible before any script has run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from hsv.base.units import UnitSystem, in_system
from hsv.pages.engine import Numbers, Plot
from hsv.pages.text import number

WIDTH, HEIGHT = 1000.0, 100.0
"""Size of the view box of a drawing, which the page scales."""

DRAWN = ("high", "bound", "reference", "mean", "nominal", "actual")
"""Kinds of the drawn curves, from back to front; ``high`` fills the area between the curves ``low`` and ``high``."""

Tick = tuple[str, float]
"""Label, and position on the axis in percent of its length."""


class Drawing(NamedTuple):
    """One plot of a picture, drawn as SVG paths."""

    plot: Plot
    paths: list[tuple[str, str, int | None]]
    """Each path: its CSS classes, SVG path data, and the index of the run with which it is hidden, or None."""
    ticks: dict[str, list[Tick]]
    """Ticks of the vertical axis, from bottom to top, by system of units."""


class Picture(NamedTuple):
    """Drawings over a common horizontal axis; shades are start and width in percent of the axis."""

    drawings: list[Drawing]
    axis: str
    ticks: list[Tick]
    shades: list[tuple[float, float]]


def picture(
    plots: Sequence[Plot],
    numbers: Numbers,
    end: float,
    shades: Sequence[tuple[float, float]] = (),
    axis: str = "time [s]",
    kinds: Sequence[str] = DRAWN,
) -> Picture:
    """Return the picture of ``plots`` over the axis from 0 to ``end``; ``shades`` are (start, end) of shaded parts."""
    marked = [(100.0 * start / end, 100.0 * (stop - start) / end) for start, stop in shades]
    drawings = [_drawing(plot, numbers, end, kinds) for plot in plots]
    return Picture(drawings, axis, _ticks(0.0, end, 1.0, 8), marked)


def _drawing(plot: Plot, numbers: Numbers, end: float, kinds: Sequence[str]) -> Drawing:
    curves = {kind: [curve for curve in plot.curves if curve["kind"] == kind] for kind in ("low", *kinds)}
    y = np.concatenate([numbers.array(curve["y"]) for found in curves.values() for curve in found])
    finite = y[np.isfinite(y)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    margin = 0.06 * (high - low) or 1e-3 * abs(high) or 1e-6
    low, high = low - margin, high + margin
    paths = []
    for kind in kinds:
        for curve in curves[kind]:
            y = numbers.array(curve["y"])
            x = numbers.array(curve["x"])[: len(y)]  # a flight may end before the others
            look, run = kind, curve["run"]
            if kind == "high":
                look, x = "band", np.append(x, x[::-1])
                y = np.append(y, numbers.array(curves["low"][0]["y"])[::-1])
            elif run is not None:
                look = f"run{run % 6} {kind}"
            paths.append((look, _path(WIDTH * x / end, HEIGHT * (high - y) / (high - low)), run))
    scales = {str(system): in_system(1.0, plot.unit, system, share=plot.share)[0] for system in UnitSystem}
    return Drawing(plot, paths, {system: _ticks(low, high, scale, 4) for system, scale in scales.items()})


def _path(across: np.ndarray, down: np.ndarray) -> str:
    """Return SVG path data through the finite points, simplified to within about 0.1 view-box units."""
    drawn = Path(np.column_stack((across, down))).cleaned(remove_nans=True, simplify=True)
    pens, points = {Path.MOVETO: "M", Path.LINETO: "L"}, np.asarray(drawn.vertices)
    codes = np.asarray(drawn.codes).tolist()
    return "".join(f"{pens[code]}{x:.4g} {y:.4g}" for code, (x, y) in zip(codes, points, strict=True) if code in pens)


def _ticks(low: float, high: float, scale: float, count: int) -> list[Tick]:
    """Return about ``count`` ticks from ``low`` to ``high`` (SI), where ``scale`` times the value is a round number."""
    places = MaxNLocator(nbins=count, steps=[1, 2, 2.5, 5, 10]).tick_values(low * scale, high * scale)
    inside = [float(place) for place in places if low <= place / scale <= high]
    return [(number(round(place, 12), 7), 100.0 * (place / scale - low) / (high - low)) for place in inside]

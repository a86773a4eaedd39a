"""The picture that a page opens with: a few of its plots as SVG, visible before any script has run."""

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
"""Size of a drawing; the page scales it."""

DRAWN = ("high", "bound", "reference", "mean", "nominal", "actual")
"""Kinds of the curves that are drawn, from below; ``high`` is the area between it and the curve ``low``."""

Tick = tuple[str, float]
"""Label, and place along the axis in percent of its length."""


class Drawing(NamedTuple):
    """A plot over the axis of a picture."""

    plot: Plot
    paths: list[tuple[str, str, int | None]]
    """Classes of the stylesheet, SVG data, and the run with which the path is hidden."""
    ticks: dict[str, list[Tick]]
    """Ticks by system of units, from below."""


class Picture(NamedTuple):
    """Drawings over one axis; a shade has its start and its width in percent."""

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
    """Return the picture of ``plots``, all over 0 ... ``end``, with stretches of the axis shaded."""
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
    """Return SVG path data through the finite points, without those that change less than a tenth of a pixel."""
    drawn = Path(np.column_stack((across, down))).cleaned(remove_nans=True, simplify=True)
    pens, points = {Path.MOVETO: "M", Path.LINETO: "L"}, np.asarray(drawn.vertices)
    codes = np.asarray(drawn.codes).tolist()
    return "".join(f"{pens[code]}{x:.4g} {y:.4g}" for code, (x, y) in zip(codes, points, strict=True) if code in pens)


def _ticks(low: float, high: float, scale: float, count: int) -> list[Tick]:
    """Return about ``count`` round numbers of the unit that ``scale`` leads to, within ``low`` ... ``high``."""
    places = MaxNLocator(nbins=count, steps=[1, 2, 2.5, 5, 10]).tick_values(low * scale, high * scale)
    inside = [float(place) for place in places if low <= place / scale <= high]
    return [(number(round(place, 12), 7), 100.0 * (place / scale - low) / (high - low)) for place in inside]

"""The look of the figures: the paper's panels, units and notation."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

RC: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 9,
    "axes.titlesize": 9,
    "legend.fontsize": 8,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.0,
    "grid.linewidth": 0.4,
    "grid.alpha": 0.35,
    "axes.grid": True,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "legend.framealpha": 0.9,
    "legend.fancybox": False,
    "pdf.fonttype": 42,
    "figure.facecolor": "white",
}
"""Settings of all figures of the study."""

BLUE, RED, GREEN, ORANGE, GREY = "#0b4f9e", "#c0392b", "#1f7a3d", "#c77700", "#777777"

WIDTH = 7.0
"""Inches: the text width of the journal's page."""


def new_figure(height: float) -> Figure:
    """Return an empty figure of the page's width and of ``height`` inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def letter(axes: Iterable[Axes]) -> None:
    """Mark panels (a), (b), ... as the paper does."""
    for index, axis in enumerate(axes):
        axis.set_title(f"({chr(ord('a') + index)})", loc="left", fontweight="bold")


def plain_log(axis: Axes) -> None:
    """Make the vertical axis logarithmic, with plain numbers on it."""
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write ``figure`` as vector PDF and as PNG; equal figures give equal files."""
    paths = [stem.with_suffix(".pdf"), stem.with_suffix(".png")]
    with matplotlib.rc_context(RC):
        figure.savefig(paths[0], metadata={"CreationDate": None})
        figure.savefig(paths[1], dpi=150, metadata={"Software": None})
    return paths

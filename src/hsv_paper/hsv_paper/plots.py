"""Style and helpers of the figures of this package: settings, panel letters, ft and deg, Bode diagrams, saving."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, MultipleLocator, NullFormatter

from hsv.base.units import to_paper
from hsv.model.lpv.linearisation import bode

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
"""The Matplotlib settings of all figures."""

BLUE, RED, GREEN, ORANGE, GREY, PURPLE = "#0b4f9e", "#c0392b", "#1f7a3d", "#c77700", "#777777", "#7d3c98"

FEET, DEGREES = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]
"""Factors from m to ft and from rad to deg, the units of the paper's axes."""

WIDTH = 7.0
"""Width of a figure (inches): the text width of the journal's page."""

DOTTED_GREY: Any = {"color": GREY, "linewidth": 0.6, "linestyle": ":"}
ZERO: Any = {"color": "black", "linewidth": 0.6}
"""Line styles: dotted for marked values, black for the zero line."""


def new_figure(height: float) -> Figure:
    """Return an empty figure as wide as the page; ``height`` in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def letter(axes: Iterable[Axes]) -> None:
    """Label the panels (a), (b), ... as the paper does."""
    for index, axis in enumerate(axes):
        axis.set_title(f"({chr(ord('a') + index)})", loc="left", fontweight="bold")


def plain_log(axis: Axes) -> None:
    """Make the vertical axis logarithmic, with plain numbers as tick labels."""
    axis.set_yscale("log")
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def save(figure: Figure, stem: Path) -> list[Path]:
    """Write ``figure`` as PDF and PNG and return both paths; equal figures give equal files."""
    pdf, png = stem.with_suffix(".pdf"), stem.with_suffix(".png")
    with matplotlib.rc_context(RC):
        figure.savefig(pdf, metadata={"CreationDate": None})
        figure.savefig(png, dpi=150, metadata={"Software": None})
    return [pdf, png]


def bode_panels() -> tuple[Figure, Axes, Axes]:
    """Return a figure with a magnitude panel above a phase panel."""
    figure = new_figure(5.0)
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    return figure, magnitude, phase


def draw_bode(
    magnitude: Axes, phase: Axes, frequencies: np.ndarray, curves: Iterable[tuple[np.ndarray, str, dict[str, Any]]]
) -> None:
    """Draw curves, each a complex response at ``frequencies`` (rad/s), a label and a style, into two panels.

    The phase is shifted by whole turns until it begins within half a turn of -270 deg. This is the phase of elevator to
    pitch rate between the slow modes and the elastic ones, so that all figures show the same branch.
    """
    for response, label, style in curves:
        decibel, degree = bode(response)
        magnitude.semilogx(frequencies, decibel, label=label, **style)
        phase.semilogx(frequencies, degree - 360.0 * np.round((degree[0] + 270.0) / 360.0), **style)
    magnitude.set_ylabel("Magnitude (dB)")
    phase.set_ylabel("Phase (deg)")
    phase.set_xlabel("Frequency (rad/s)")
    phase.yaxis.set_major_locator(MultipleLocator(45.0))
    for axis in (magnitude, phase):
        axis.set_xlim(frequencies[0], frequencies[-1])
        axis.grid(which="minor", linewidth=0.25, alpha=0.25)

"""Panels of flights in one static figure; by default the paper's: trajectory, attitude, elastic rates, inputs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO, StringIO
from itertools import cycle
from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hsv.base.errors import ParameterError, one_of
from hsv.base.units import UnitSystem, in_system, parse_quantity
from hsv.flight.metrics import FlightData
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS

_NAMES, _UNITS = (*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS)
_STATES = ("altitude", "velocity", "angle_of_attack", "pitch_rate", "elastic_rate_1", "elastic_rate_2")

_REMARK_WIDTH = 130
"""Maximum number of characters in a line of a remark."""

DASHES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 1.5, 1.5, 1.5)))
"""Line styles of the flights, in turn."""

_ONE_COLUMN = 5.0
"""Width (inches) up to which panels lie below each other, in smaller type: a column of a journal."""

INK, _GRID = "#123456", "#654321"
"""Colours that the page replaces by its own, which follow the reader's light or dark scheme."""

_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "hsv",
    "font.size": 9,
    "axes.grid": True,
    "grid.linewidth": 0.5,
    **dict.fromkeys(("axes.spines.top", "axes.spines.right"), False),
    **dict.fromkeys(("figure.facecolor", "axes.facecolor"), "none"),
    **dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK),
    "grid.color": _GRID,
}
_INCH = 0.0254
_SMALLEST, _LARGEST = 1.0, 40.0
"""Limits of a figure's sides (inches)."""


@dataclass(frozen=True)
class Layout:
    """The choice of panels, times and size of a figure; the defaults are the paper's panels on a page's width."""

    panels: tuple[str, ...] = ()
    """Names of states and inputs, or their beginnings; empty: the paper's panels"""
    start: float = 0.0
    """First time (s) that is drawn"""
    end: float = math.inf
    """Last time (s) that is drawn"""
    size: tuple[float, float] | None = None
    """Width and height (inches); None: two columns of panels on 10 inches"""

    @classmethod
    def of(cls, panels: Sequence[str] = (), start: str = "", end: str = "", size: str = "") -> Layout:
        """Return the layout that the texts describe: times with unit, a size such as ``85x60mm``.

        Raises:
            ParameterError: A panel is unknown, the window is empty, or the size is none; the message names it.
            QuantityError: A time cannot be read.
        """
        first = parse_quantity(start, "s", "from") if start else 0.0
        last = parse_quantity(end, "s", "to") if end else math.inf
        if not first < last:
            raise ParameterError(f"from = {start!r}: expected less than to = {end!r}")
        chosen = [chosen_name(given, _NAMES) for given in panels]
        if not size:
            return cls(tuple(chosen), first, last)
        read = re.fullmatch(r"([\d.]+)x([\d.]+) ?(mm|cm|in)", size)
        sides = [parse_quantity(f"{side} {read[3]}", "m", "size") / _INCH for side in read.groups()[:2]] if read else []
        if not sides or not all(_SMALLEST <= side <= _LARGEST for side in sides):
            raise ParameterError(f"size = {size!r}: expected width x height from 1 to 40 inches, such as 85x60mm")
        return cls(tuple(chosen), first, last, (sides[0], sides[1]))


def chosen_name(given: str, known: Collection[str]) -> str:
    """Return the ``known`` name that is ``given`` or begins so; a ParameterError if there is none, or several."""
    name = given.strip().replace(" ", "_")
    found = [name] if name in known else [each for each in known if name and each.startswith(name)]
    if len(found) != 1:
        raise ParameterError(f"panels: {given!r}, expected {one_of(found or known, name)}")
    return found[0]


@contextmanager
def panel_figure(count: int, layout: Layout, *, sharex: bool = True) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure with ``count`` panels in the size and type of ``layout``; draw within the context."""
    wide = not layout.size or layout.size[0] > _ONE_COLUMN
    columns = 2 if count > 1 and wide else 1
    rows, points = -(-count // columns), 9 if wide else 7
    with matplotlib.rc_context({"font.size": points, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=layout.size or (5.0 * columns, 2.25 * rows), layout="constrained")
        axes = figure.subplots(rows, columns, sharex=sharex, squeeze=False).ravel().tolist()
        yield figure, axes[:count]
        for axis in axes[:count]:
            axis.set_title(axis.get_title(loc="left"), loc="left", fontsize=points)
            axis.grid(alpha=0.25, linewidth=0.5)
        for axis in axes[count:]:
            axis.set_visible(False)


def outer_legend(figure: Figure, axes: Sequence[Axes]) -> None:
    """Add one legend for all ``axes`` above them."""
    labels = {label: handle for axis in axes for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(labels.values(), labels, loc="outside upper left", ncols=2 * _columns(axes), frameon=False)


def _columns(axes: Sequence[Axes]) -> int:
    spec = axes[0].get_subplotspec()
    return spec.get_gridspec().ncols if spec else 1


def flight_figure(
    flights: Mapping[str, FlightData], system: UnitSystem, remarks: Sequence[str] = (), layout: Layout | None = None
) -> Figure:
    """Return a figure of panels over time, with one curve per flight.

    Without a choice in ``layout`` there are eight panels, or six if all vehicles are rigid. The references of altitude
    and velocity are dotted, and the time from the first fault on is shaded; both are those of the first flight. Curves
    that coincide stay visible: each flight has its own dashes, the first one lies below the others.

    Args:
        flights: The flights by label.
        system: Units of the axes.
        remarks: Remarks on the flights, such as missing steps, printed above the panels.
        layout: Panels, times and size.
    """
    layout = layout or Layout()
    histories = {label: np.hstack((flight.history.state, flight.history.command)) for label, flight in flights.items()}
    panels = [_NAMES.index(name) for name in layout.panels] or [
        column
        for column in map(_NAMES.index, (*_STATES, *INPUT_NAMES))
        if not _NAMES[column].startswith("elastic") or any(history[:, column].any() for history in histories.values())
    ]
    with panel_figure(len(panels), layout) as (figure, axes):
        first = next(iter(flights.values()))
        for axis, column in zip(axes, panels, strict=False):
            factor, shown = in_system(1.0, _UNITS[column], system)
            for (name, flight), dashes in zip(flights.items(), cycle(DASHES), strict=False):
                drawn = (flight.time >= layout.start) & (flight.time <= layout.end)
                curve = factor * histories[name][drawn, column]
                axis.plot(flight.time[drawn], curve, linewidth=1.1, linestyle=dashes, label=name)
            drawn = (first.time >= layout.start) & (first.time <= layout.end)
            if _NAMES[column] in ("altitude", "velocity"):
                reference = factor * first.reference[drawn, column]
                axis.plot(first.time[drawn], reference, "k:", linewidth=1.0, label="reference")
            if first.fault_start is not None and first.fault_start < first.time[drawn].max(initial=0.0):
                begun = max(first.fault_start, layout.start)
                axis.axvspan(begun, first.time[drawn][-1], color="tab:red", alpha=0.06, linewidth=0)
            unit = "" if _UNITS[column] == "1" else f" [{mathtext(shown)}]"
            axis.set_title(_NAMES[column].replace("_", " ") + unit, loc="left")
            axis.margins(x=0)
            axis.ticklabel_format(useOffset=False)
        if remarks:
            figure.suptitle("\n".join(fill(remark, _REMARK_WIDTH) for remark in remarks), fontsize=8, color="tab:red")
        if layout.size:
            outer_legend(figure, axes)
        else:
            axes[0].legend(frameon=False, loc="lower right")
        for axis in axes[max(len(panels) - _columns(axes), 0) :]:
            axis.set_xlabel("time [s]")
            axis.tick_params(labelbottom=True)
    return figure


def inline_svg(make: Callable[[], Figure]) -> Markup:
    """Return the figure that ``make`` draws as SVG for a page, without the head of a file, in the page's colours."""
    with matplotlib.rc_context(_STYLE):
        figure, text = make(), StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None})
    svg = text.getvalue().replace(INK, "currentColor").replace(_GRID, "var(--grid)")
    return Markup(svg[svg.index("<svg") :])


def save_figure(figure: Figure, path: Path) -> None:
    """Save ``figure`` in the format that the suffix of ``path`` names; equal flights give equal files."""
    metadata: dict[str, str | None] = {}
    if path.suffix in (".svg", ".pdf"):
        metadata = {"Date" if path.suffix == ".svg" else "CreationDate": None}
    # Text stays text, which an editor or a search finds.
    with matplotlib.rc_context({"svg.hashsalt": "hsv", "pdf.fonttype": 42}):
        # Render in memory first: on a full disk, the exceptions of matplotlib would depend on the format.
        whole = BytesIO()
        figure.savefig(whole, format=path.suffix[1:], dpi=110, metadata=metadata)
    path.write_bytes(whole.getvalue())


def mathtext(unit: str) -> str:
    """Return a unit in the notation of matplotlib."""
    return unit.replace("^0.5", "$^{1/2}$")

"""The paper's panels of a flight in one static figure: trajectory, attitude, elastic rates, inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from textwrap import fill

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from hsv.base.units import UnitSystem, in_system
from hsv.flight.metrics import FlightData
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, STATE_NAMES, STATE_UNITS

_NAMES, _UNITS = (*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS)
_STATES = ("altitude", "velocity", "angle_of_attack", "pitch_rate", "elastic_rate_1", "elastic_rate_2")

_REMARK_WIDTH = 130
"""Maximum number of characters in a line of a remark."""


def flight_figure(flights: Mapping[str, FlightData], system: UnitSystem, remarks: Sequence[str] = ()) -> Figure:
    """Return a figure of panels over time, with one curve per flight.

    There are eight panels, or six if all vehicles are rigid. The references of altitude and velocity are dotted, and
    the time from the first fault on is shaded; both are those of the first flight.

    Args:
        flights: The flights by label.
        system: Units of the axes.
        remarks: Remarks on the flights, such as missing steps, printed above the panels.
    """
    histories = {label: np.hstack((flight.history.state, flight.history.command)) for label, flight in flights.items()}
    panels = [
        column
        for column in map(_NAMES.index, (*_STATES, *INPUT_NAMES))
        if not _NAMES[column].startswith("elastic") or any(history[:, column].any() for history in histories.values())
    ]
    rows = (len(panels) + 1) // 2
    with matplotlib.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(10, 2.25 * rows), layout="constrained")
        axes = figure.subplots(rows, 2, sharex=True).ravel()
        first = next(iter(flights.values()))
        for axis, column in zip(axes, panels, strict=True):
            factor, shown = in_system(1.0, _UNITS[column], system)
            for name, flight in flights.items():
                axis.plot(flight.time, factor * histories[name][:, column], linewidth=1.1, label=name)
            if _NAMES[column] in ("altitude", "velocity"):
                axis.plot(first.time, factor * first.reference[:, column], "k:", linewidth=1.0, label="reference")
            if first.fault_start is not None:
                axis.axvspan(first.fault_start, first.time[-1], color="tab:red", alpha=0.06, linewidth=0)
            unit = "" if _UNITS[column] == "1" else f" [{_mathtext(shown)}]"
            axis.set_title(_NAMES[column].replace("_", " ") + unit, loc="left", fontsize=9)
            axis.grid(alpha=0.25, linewidth=0.5)
            axis.margins(x=0)
        if remarks:
            figure.suptitle("\n".join(fill(remark, _REMARK_WIDTH) for remark in remarks), fontsize=8, color="tab:red")
        axes[0].legend(frameon=False, loc="lower right")
        for axis in axes[-2:]:
            axis.set_xlabel("time [s]")
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Save ``figure`` in the format that the suffix of ``path`` names; equal flights give equal files."""
    metadata: dict[str, str | None] = {}
    if path.suffix in (".svg", ".pdf"):
        metadata = {"Date" if path.suffix == ".svg" else "CreationDate": None}
    with matplotlib.rc_context({"svg.hashsalt": "hsv"}):
        # Render in memory first: on a full disk, the exceptions of matplotlib would depend on the format.
        whole = BytesIO()
        figure.savefig(whole, format=path.suffix[1:], dpi=110, metadata=metadata)
    path.write_bytes(whole.getvalue())


def _mathtext(unit: str) -> str:
    return unit.replace("^0.5", "$^{1/2}$")

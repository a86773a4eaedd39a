"""The page on stability margins: Nyquist plot with the forbidden disk, Bode plot of L and S, margins by vertex."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.errors import DesignError
from hsv.base.units import UnitSystem
from hsv.certificate.loops import INPUTS, SampledLoop, vertex_loops
from hsv.certificate.margins import grid
from hsv.flight.margins import VERTICES, MarginResults
from hsv.pages.engine import render, write_page
from hsv.pages.plots import INK, inline_svg

SECTIONS = {"curves": "Elevator loop", "margins": "Margins", "terms": "Terms"}
"""Headings in the order of the page."""

_COLOURS = ("#0072b2", "#d55e00", "#009e73")


def write_margin_page(results: MarginResults, out: Path) -> None:
    """Write the page on ``results`` to the HTML file ``out``.

    Raises:
        DesignError: The file cannot be written.
    """
    write_page(margin_page(results), out, DesignError)


def margin_page(results: MarginResults) -> str:
    """Return the page on ``results``."""
    elevator = {title: {each.name: each for each in found}["elevator"] for title, found in results.loops.items()}
    words = {
        title: f"disk margin {each.disk.margin:.3f}, which guarantees {20.0 * np.log10(each.disk.gain):.1f} dB and "
        f"{np.degrees(each.disk.phase):.0f} deg"
        if each.disk.margin
        else "unstable"
        for title, each in elevator.items()
    }
    values: dict[str, Any] = {
        "results": results,
        "sections": SECTIONS,
        "units": UnitSystem.metric,
        "elevator": elevator,
    }
    return render("margins.html.j2", **values, words=words, curves=inline_svg(lambda: figure_of(results)))


def figure_of(results: MarginResults) -> Figure:
    """Return the figure: the elevator loop at the worst place of each section, and all vertices' disk margins."""
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    nyquist, gain, vertices, phase = figure.subplots(2, 2).ravel()
    frequencies = grid(results.design.period, 1200)
    frequencies = frequencies[frequencies > 0.1]
    for (title, loop), colour in zip(_worst_loops(results).items(), _COLOURS, strict=False):
        S = loop.broken("elevator").sensitivity(frequencies)[:, 0, 0]
        L = 1.0 / S - 1.0
        nyquist.plot(L.real, L.imag, color=colour, linewidth=1.2, label=title)
        for values, style, name in ((L, "-", "L"), (S, "--", "S")):
            label = f"{name}, {title}"
            gain.semilogx(frequencies, 20.0 * np.log10(np.abs(values)), style, color=colour, linewidth=1.1, label=label)
        degrees = np.degrees(np.unwrap(np.angle(L)))
        # The turn in which the phase at unit gain is next to -180 deg.
        degrees -= 360.0 * np.round((degrees[np.argmin(np.abs(np.log(np.abs(L))))] + 180.0) / 360.0)
        phase.semilogx(frequencies, degrees, color=colour, linewidth=1.1)
    least = min(each.disk.margin for found in results.loops.values() for each in found if each.name == "elevator")
    if least > 0.0:
        low, high = -(2.0 + least) / (2.0 - least), -(2.0 - least) / (2.0 + least)
        disk = 0.5 * (low + high) + 0.5 * (high - low) * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 200))
        nyquist.fill(disk.real, disk.imag, color="#b3261e", alpha=0.2, linewidth=0.0, label=f"disk of {least:.3f}")
    nyquist.plot(-1.0, 0.0, "+", color=INK)
    nyquist.set(xlim=(-4.0, 2.0), ylim=(-3.0, 3.0), aspect="equal", xlabel="real part of L", ylabel="imaginary part")
    nyquist.legend(frameon=False, loc="lower left")
    gain.set(ylabel="magnitude [dB]", xlabel="frequency [rad/s]", ylim=(-40.0, 40.0))
    gain.legend(frameon=False, loc="lower left")
    phase.set(ylabel="phase of L [deg]", xlabel="frequency [rad/s]")
    for each, marker in zip([each for each in results.loops[VERTICES] if each.name in INPUTS], "o^s", strict=True):
        vertices.plot(list(each.each.values()), marker, markersize=4, label=each.name)
    vertices.set(xlabel="vertex", ylabel="disk margin", ylim=(0.0, 2.0))
    vertices.legend(frameon=False)
    return figure


def _worst_loops(results: MarginResults) -> dict[str, SampledLoop]:
    """Return, by title of a section, the loop of the place where the elevator has the smallest disk margin."""
    found = {}
    for title, rows in results.loops.items():
        where = {each.name: each for each in rows}["elevator"].where
        if title == VERTICES:
            found[title] = vertex_loops(results.design)[int(where.removeprefix("vertex "))]
        else:
            found[title] = results.vehicles[title].loop("", where)
    return found

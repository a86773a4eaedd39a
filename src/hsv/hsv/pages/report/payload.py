"""Data for the page's script: numbers in one compressed block, and a description of the panels that use them."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Sequence
from typing import Any

import numpy as np

from hsv.flight.metrics import in_words
from hsv.model.airframe import side_view
from hsv.pages.report.curves import DrawnCurve
from hsv.pages.report.differences import Difference
from hsv.pages.report.events import Event
from hsv.pages.report.panels import Kind, Panel
from hsv.pages.report.run import ReportedRun
from hsv.pages.report.text import units_of

_COMMON = (Kind.reference, Kind.bound)
"""Kinds that are drawn once, for all flights, where they are the same in all."""


def compressed(data: bytes) -> str:
    """Return ``data`` gzipped, as base64; the same text for the same data."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode()


class Numbers:
    """Arrays one after the other, in single precision: seven digits, more than a plot can show."""

    def __init__(self) -> None:
        self._blocks: list[bytes] = []
        self._known: dict[bytes, int] = {}
        self.lengths: list[int] = []

    def add(self, values: np.ndarray) -> int:
        """Return the number of the array, which is stored once."""
        with np.errstate(over="ignore"):
            block = np.asarray(values, "<f4").tobytes()
        if block not in self._known:
            self._known[block] = len(self.lengths)
            self._blocks.append(_transposed(block))
            self.lengths.append(len(values))
        return self._known[block]

    def packed(self) -> str:
        """Return all arrays, compressed."""
        return compressed(b"".join(self._blocks))


def _transposed(block: bytes) -> bytes:
    """Return numbers in single precision so that they compress well, and without loss.

    Their bits as integers, each less the one before it; then all lowest bytes, and so on to the highest ones.
    """
    bits = np.frombuffer(block, "<u4")
    return np.diff(bits, prepend=np.uint32(0)).astype("<u4").view("u1").reshape(-1, 4).T.tobytes()


def payload(runs: Sequence[ReportedRun], differences: Sequence[Difference]) -> tuple[dict[str, Any], str]:
    """Return the description of the plots, as plain data, and the numbers they draw, compressed."""
    numbers = Numbers()
    panels = [_panel(panel, runs, numbers) for panel in all_panels(runs)]
    panels += [_difference(difference, runs, numbers) for difference in differences if not difference.none]
    described = {
        "runs": [{"label": run.label, "end": run.duration, "faults": _faults(run)} for run in runs],
        "airframe": side_view.geometry(),
        "panels": panels,
        "lengths": numbers.lengths,
    }
    return described, numbers.packed()


def _faults(run: ReportedRun) -> list[dict[str, Any]]:
    """Return what failed when, in words that name no number: the list of events has those."""
    return [
        {
            "channel": fault["channel"],
            "text": f"{in_words(fault['channel'])}: {in_words(fault['type'])}",
            "from": fault["start_s"],
            "to": run.duration if fault["end_s"] is None else fault["end_s"],
        }
        for fault in run.description["faults"] or ()
    ]


def all_panels(runs: Sequence[ReportedRun]) -> list[Panel]:
    """Return the panels that any of ``runs`` has, in the order of the page."""
    longest = max(runs, key=lambda run: len(run.curves.panels)).curves.panels
    others = [panel for run in runs for panel in run.curves.panels if panel not in longest]
    return [*longest, *dict.fromkeys(others)]


def _panel(panel: Panel, runs: Sequence[ReportedRun], numbers: Numbers) -> dict[str, Any]:
    drawn = [run.curves.curves.get(panel.name, []) for run in runs]
    curves: list[dict[str, Any]] = []
    for index in sorted(range(len(runs)), key=lambda index: _extent(drawn[index]), reverse=True):
        for curve in drawn[index]:
            common = curve.kind in _COMMON and _agreed(curve, drawn)
            described = {"kind": curve.kind, "label": curve.label, "run": None if common else index}
            if common and any(described.items() <= other.items() for other in curves):
                continue
            time = runs[index].curves.time
            time = time if len(curve.y) == len(time) else time[[0, -1]]
            curves.append(described | {"x": numbers.add(time), "y": numbers.add(curve.y)})
    return {
        "name": panel.name,
        "units": units_of(panel.unit),
        "curves": curves,
        "limits": sorted({limit for run in runs for limit in run.input_limits.get(panel.name, ())}),
        "shades": _shades(panel, runs),
    }


def _difference(difference: Difference, runs: Sequence[ReportedRun], numbers: Numbers) -> dict[str, Any]:
    label = f"less {runs[0].label}"
    return {
        "name": difference.name,
        "units": units_of(difference.panel.unit),
        "curves": [
            {"kind": Kind.actual, "label": label, "run": d.run, "x": numbers.add(d.time), "y": numbers.add(d.y)}
            for d in sorted(difference.runs, key=lambda d: d.largest, reverse=True)
        ],
        "limits": [],
        "shades": [shade for shade in _shades(difference.panel, runs) if shade["kind"] == "fault"],
    }


def _agreed(wanted: DrawnCurve, drawn: Sequence[Sequence[DrawnCurve]]) -> bool:
    """Return whether a curve is the same in all flights that have it."""
    return all(np.array_equal(curve.y, wanted.y) for curves in drawn for curve in curves if curve.label == wanted.label)


def _extent(curves: Sequence[DrawnCurve]) -> float:
    """Return the range of the actual curve: the widest is drawn first, so that it hides no other."""
    finite = [curve.y[np.isfinite(curve.y)] for curve in curves if curve.kind is Kind.actual]
    return max((float(np.ptp(y)) for y in finite if len(y)), default=0.0)


def _shades(panel: Panel, runs: Sequence[ReportedRun]) -> list[dict[str, Any]]:
    shades: dict[tuple[str, float, float], list[int]] = {}
    for index, run in enumerate(runs):
        for event in run.events:
            if _belongs(event, panel):
                end = run.duration if event.end is None else event.end
                shades.setdefault((event.kind, event.start, end), []).append(index)
    return [{"kind": kind, "from": start, "to": end, "runs": owners} for (kind, start, end), owners in shades.items()]


def _belongs(event: Event, panel: Panel) -> bool:
    match event.kind:
        case "fault":
            return True
        case "tube":
            return panel.shading == "tube"
        case "saturation":
            return panel.shading == event.subject
    return False

"""The report of recorded flights: a self-contained HTML page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError
from hsv.base.units import UnitSystem
from hsv.flight.flight import step_times_in_words
from hsv.flight.limits import criteria_not_judged, limits_kept, verdict_sentence
from hsv.flight.metrics import CRITERIA, METRICS, Group, Metric, in_words
from hsv.flight.scenario import scenario_names
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.pages.engine import Numbers, Plot, render, write_page
from hsv.pages.events import Event
from hsv.pages.flights import DrawnCurve, ReportedRun, reported_runs
from hsv.pages.panels import GROUPS, Kind, Panel
from hsv.pages.picture import Drawing, Line, Picture, drawing, picture
from hsv.pages.side_view import geometry
from hsv.pages.text import capitalised, number, percent, quantity, switched

DECLARED = {p.name: p for table in (LOCKSTEP_PARAMETERS, *NODE_PARAMETERS.values()) for p in table}
"""Declarations of all parameters of the nodes by name."""

EVENTS_SHOWN = 200
"""Maximum number of listed events of a run; the page states the total number."""

PICTURED = ("altitude", "velocity", "angle_of_attack", "level")
"""Panels of the picture at the top of the page."""

COMPARED = ("trajectory", "attitude", "elastic", "inputs", "tube")
"""Groups of panels whose differences are plotted, without errors in the tube, which repeat those of the state."""

NEARLY = 0.01
"""Largest difference of flights that nearly agree, as a share of the range of a quantity."""


def write_report(bags: Sequence[Bag], out: Path, *, units: UnitSystem = UnitSystem.metric) -> None:
    """Write the report of ``bags``, with common plots, to the HTML file ``out``.

    Args:
        bags: One flight, or several flights to compare.
        out: File to write.
        units: Initial units of the page.

    Raises:
        RecordingError: A bag holds no flight, or the file cannot be written.
    """
    write_page(report_page(reported_runs(bags), units=units), out, RecordingError)


def report_page(runs: Sequence[ReportedRun], *, units: UnitSystem = UnitSystem.metric) -> str:
    """Return the HTML page of the report."""
    numbers, differences = Numbers(), flight_differences(runs)
    plots = [_plot(panel, runs, numbers) for panel in all_panels(runs)]
    plots += [_difference_plot(found, runs, numbers) for found in differences if any(d.largest for d in found)]
    drawn = {plot.group for plot in plots}
    groups = {key: heading for key, heading in GROUPS.items() if key in drawn}
    sections = {"summary": "Summary", "metrics": "Metrics", "events": "Events", "vehicle": "Vehicle"}
    if differences:
        sections["differences"] = "Differences"
    sections |= groups | {"parameters": "Parameters", "certificate": "Certificate", "repeat": "Repeat"}
    faults = [_faults(run) for run in runs]
    return render(
        "report.html.j2",
        plots=plots,
        numbers=numbers,
        described={
            "runs": [
                {"label": run.label, "end": run.duration, "faults": found}
                for run, found in zip(runs, faults, strict=True)
            ],
            "airframe": geometry(),
        },
        runs=runs,
        units=units,
        sections=sections,
        groups=groups,
        sentence=sentence(runs),
        happened=happened(runs, differences),
        verdict=verdict,
        step_times=step_times_in_words,
        picture=_picture(runs),
        effectors=any(curve.kind is Kind.effector for run in runs for c in run.curves.curves.values() for curve in c),
        equal=[found[0].panel.title for found in differences if not any(d.largest for d in found)],
        criteria=CRITERIA,
        metrics=_grouped(runs),
        differing={name for name in METRICS if len({run.metrics.get(name) for run in runs}) > 1},
        parameters={part: list(_parameters(part, runs)) for part in ("scenario", "design")},
        shipped_scenarios=scenario_names(),
        events_shown=EVENTS_SHOWN,
        airframe=geometry(),
    )


def all_panels(runs: Sequence[ReportedRun]) -> list[Panel]:
    """Return the panels of all ``runs`` in the order of the page."""
    most = max(runs, key=lambda run: len(run.curves.panels))
    return list({name: panel for run in (most, *runs) for name, panel in run.curves.panels.items()}.values())


def sentence(runs: Sequence[ReportedRun]) -> Markup:
    """Return the verdict on one or several flights in all systems of units."""
    if len(runs) == 1:
        return verdict(runs[0])
    return switched({system: str(escape(f"{capitalised(_several(runs, system))}.")) for system in UnitSystem})


def verdict(run: ReportedRun) -> Markup:
    """Return the verdict on one flight in all systems of units."""
    texts = {system: _one(run, verdict_sentence(run.verdicts, run.metrics, system)) for system in UnitSystem}
    return switched({system: str(escape(f"{capitalised(text)}.")) for system, text in texts.items()})


def _several(runs: Sequence[ReportedRun], system: UnitSystem) -> str:
    judged = [run for run in runs if run.verdicts or run.failure]
    if not judged:
        return "there are no limits to judge these flights by"
    good = sum(run.good for run in judged)
    which = " that have limits" if len(judged) < len(runs) else ""
    parts = [f"within all of their limits: {good} of {len(judged)} flights{which}"]
    parts += [f"{run.label}: {_one(run, limits_kept(run.verdicts, system))}" for run in judged if not run.good]
    for run in judged:
        if free := criteria_not_judged(run.verdicts, run.metrics, system):
            parts.append(f"{run.label}: not judged: {', '.join(free)}")
    return "; ".join(parts)


def _one(run: ReportedRun, limits: str) -> str:
    """Return the verdict on the ``limits`` with remarks about an early end and an incomplete recording."""
    parts = [f"lost: {run.failure}"] if run.failure else []
    parts.append(limits if run.scenario else run.remark)
    if run.incomplete:
        parts.append(f"recorded are {run.incomplete}")
    return "; ".join(parts)


def happened(runs: Sequence[ReportedRun], differences: Sequence[Sequence[Difference]]) -> str:
    """Return a summary of the events of one flight, or of the agreement of several; empty without common curves."""
    if len(runs) > 1:
        return f"{capitalised(text)}." if (text := _agreement(differences)) else ""
    (run,) = runs
    faults, tube = run.description["faults"] or (), run.description["tube"]
    text = "no fault"
    if faults:
        more = f" and {len(faults) - 1} more" if len(faults) > 1 else ""
        kind, channel = in_words(faults[0]["type"]), in_words(faults[0]["channel"])
        text = f"{kind} of the {channel} from {number(faults[0]['start_s'])} s{more}"
    if tube and tube["checked_steps"]:
        outside, checked = tube["outside_steps"], tube["checked_steps"]
        where = f"left the invariant set in {outside} of {checked} steps" if outside else "stayed in the invariant set"
        text += f"; the error {where}, largest level {number(tube['largest_level'], 3)}"
    return f"{capitalised(text)}."


def _agreement(differences: Sequence[Sequence[Difference]]) -> str:
    if not differences:
        return ""
    most = max((difference for found in differences for difference in found), key=lambda d: d.share)
    title = most.panel.title[0].lower() + most.panel.title[1:]
    if not any(difference.largest for found in differences for difference in found):
        return "states and commands are the same, bit for bit"
    if most.share <= NEARLY:
        return f"the flights nearly agree: no quantity differs by more than {percent(most.share)} of its range"
    if not np.isfinite(most.share):
        return f"the flights differ most in {title}"
    return f"the flights differ most in {title}, by {percent(most.share)} of its range"


@dataclass(frozen=True)
class Difference:
    """The difference ``y`` (n; SI) of a run from the first one over their common ``time`` (n; s)."""

    panel: Panel
    run: int
    time: np.ndarray
    y: np.ndarray
    range: float
    """Range from the smallest to the largest value of the first run."""

    @property
    def largest(self) -> float:
        """Largest magnitude of the difference."""
        return float(np.nanmax(np.abs(self.y)))

    @property
    def share(self) -> float:
        """Largest magnitude relative to the range; infinite if the first run is constant."""
        return 0.0 if not self.largest else self.largest / self.range if self.range else np.inf


def flight_differences(runs: Sequence[ReportedRun]) -> list[list[Difference]]:
    """Return the differences of all other runs from the first one, by panel, in double precision."""
    found = []
    for panel in runs[0].curves.panels.values():
        if panel.group in COMPARED and not panel.name.startswith("error_"):
            each = [_difference(panel, runs[0], index, run) for index, run in enumerate(runs[1:], 1)]
            found.append([difference for difference in each if difference is not None])
    return [each for each in found if each]


def _difference(panel: Panel, first: ReportedRun, index: int, run: ReportedRun) -> Difference | None:
    ours, theirs = first.curves.actual(panel.name), run.curves.actual(panel.name)
    if ours is None or theirs is None:
        return None
    clock, other_clock = (np.round(each.curves.time * 1e9).astype(np.int64) for each in (first, run))
    _, rows, other_rows = np.intersect1d(clock, other_clock, assume_unique=True, return_indices=True)
    y = theirs[other_rows] - ours[rows]
    if not np.isfinite(y).any():
        return None
    return Difference(panel, index, first.curves.time[rows], y, float(np.ptp(ours[np.isfinite(ours)])))


def _difference_plot(found: Sequence[Difference], runs: Sequence[ReportedRun], numbers: Numbers) -> Plot:
    panel, curves, notes = found[0].panel, [], []
    for each in sorted(found, key=lambda difference: difference.largest, reverse=True):
        x, y = numbers.add(each.time), numbers.add(each.y)
        curves.append({"kind": Kind.actual, "label": f"less {runs[0].label}", "run": each.run, "x": x, "y": y})
    for each in found:
        text = quantity(each.largest, panel.unit, 3)
        text += f" at {number(float(each.time[np.nanargmax(np.abs(each.y))]), 6)} s"
        text += f" ({percent(each.share)})" if each.range else ""
        notes.append(Markup('<span class="swatch run{}"></span> {}').format(each.run % 6, text))
    shades = [shade for shade in _shades(panel, runs) if shade["kind"] == "fault"]
    return Plot(f"difference_{panel.name}", panel.title, panel.unit, "differences", curves, shades=shades, notes=notes)


def _plot(panel: Panel, runs: Sequence[ReportedRun], numbers: Numbers) -> Plot:
    """Return the plot of a panel with the curves of all runs; curves common to all are drawn once."""
    curves: list[dict[str, Any]] = []
    # The curve with the largest range is drawn first, so that it does not hide the others.
    widths = {index: float(np.ptp(y[np.isfinite(y)])) for index, y in enumerate(_actual(panel, runs)) if y is not None}
    for index in sorted(widths, key=lambda index: widths[index], reverse=True):
        own = runs[index].curves
        for curve in own.curves[panel.name]:
            common = curve.kind in (Kind.reference, Kind.bound) and _agreed(curve, panel, runs)
            described = {"kind": curve.kind, "label": curve.label, "run": None if common else index}
            if not (common and any(described.items() <= other.items() for other in curves)):
                curves.append(described | {"x": numbers.add(own.over(curve)), "y": numbers.add(curve.y)})
    limits = sorted({limit for run in runs for limit in run.input_limits.get(panel.name, ())})
    notes = []
    if len(limits) > 1:
        ends = (quantity(limit, panel.unit, 4) for limit in (limits[0], limits[-1]))
        notes = [Markup("limits {} … {}").format(*ends)]
    return Plot(panel.name, panel.title, panel.unit, panel.group, curves, False, limits, _shades(panel, runs), notes)


def _actual(panel: Panel, runs: Sequence[ReportedRun]) -> list[np.ndarray | None]:
    return [run.curves.actual(panel.name) for run in runs]


def _agreed(curve: DrawnCurve, panel: Panel, runs: Sequence[ReportedRun]) -> bool:
    """Return whether ``curve`` is the same in all flights that have it."""
    drawn = [other for run in runs for other in run.curves.curves.get(panel.name, ()) if other.label == curve.label]
    return all(np.array_equal(other.y, curve.y) for other in drawn)


def _faults(run: ReportedRun) -> list[dict[str, Any]]:
    """Return the faults of a run for the player, without their parameters, which are in the list of events."""
    return [
        {
            "channel": fault["channel"],
            "text": f"{in_words(fault['channel'])}: {in_words(fault['type'])}",
            "from": fault["start_s"],
            "to": run.duration if fault["end_s"] is None else fault["end_s"],
        }
        for fault in run.description["faults"] or ()
    ]


def _shades(panel: Panel, runs: Sequence[ReportedRun]) -> list[dict[str, Any]]:
    shades: dict[tuple[str, float, float], list[int]] = {}
    for index, run in enumerate(runs):
        for event in run.events:
            if _belongs(event, panel):
                end = run.duration if event.end is None else event.end
                shades.setdefault((event.kind, event.start, end), []).append(index)
    return [{"kind": kind, "from": start, "to": end, "runs": owners} for (kind, start, end), owners in shades.items()]


def _belongs(event: Event, panel: Panel) -> bool:
    if event.kind == "saturation":
        return panel.shading == event.subject
    return event.kind == "fault" or (event.kind == "tube" and panel.shading == "tube")


def _picture(runs: Sequence[ReportedRun]) -> Picture:
    end = max(run.duration for run in runs) or 1.0
    faults = [event for run in runs for event in run.events if event.kind == "fault"]
    shades = sorted({(event.start, end if event.end is None else event.end) for event in faults})
    panels = {panel.name: panel for panel in all_panels(runs)}
    return picture([_drawing(panels[name], end, runs) for name in PICTURED if name in panels], end, shades)


def _drawing(panel: Panel, end: float, runs: Sequence[ReportedRun]) -> Drawing:
    """Return a panel of the picture with the flights on top; only a single flight shows its nominal trajectory."""
    kinds = [Kind.bound, Kind.reference, Kind.nominal, Kind.actual]
    if len(runs) > 1:
        kinds.remove(Kind.nominal)
    lines: list[Line] = []
    for kind in kinds:
        for index, run in enumerate(runs):
            for curve in run.curves.curves.get(panel.name, ()):
                known = kind is not Kind.actual and any(np.array_equal(curve.y, line.y) for line in lines)
                if curve.kind is kind and not known:
                    own = kind in (Kind.actual, Kind.nominal)
                    look = f"run{index % 6} {kind}" if own else str(kind)
                    lines.append(Line(look, run.curves.over(curve), curve.y, index if own else None))
    return drawing(panel.title, panel.unit, end, lines)


def _grouped(runs: Sequence[ReportedRun]) -> dict[Group, dict[str, Metric]]:
    """Return the metrics with a value or a verdict in any of the runs, by group."""
    known = {name for run in runs for name in (*run.metrics, *run.verdicts)}
    groups = {
        group: {name: metric for name, metric in METRICS.items() if metric.group is group and name in known}
        for group in Group
    }
    return {group: metrics for group, metrics in groups.items() if metrics}


def _parameters(part: str, runs: Sequence[ReportedRun]) -> Iterator[tuple[str, str, list[Markup]]]:
    """Yield name, description and values of each parameter; equal values of all runs are given once."""
    for name in dict.fromkeys(name for run in runs for name in run.parameters[part]):
        values = [run.parameters[part].get(name) for run in runs]
        if all(value == values[0] for value in values):
            values = values[:1]
        yield name, DECLARED[name].description if name in DECLARED else "", [_value(name, value) for value in values]


def _value(name: str, value: Any) -> Markup:
    """Return the value of a parameter as HTML; long lists of numbers are collapsed."""
    unit = (DECLARED[name].unit if name in DECLARED else "") or "1"
    match value:
        case None | "" | []:
            return Markup("–")
        case bool():
            return Markup("yes" if value else "no")
        case int() | float():
            # A frequency in hertz or rad/s is the same in all systems.
            return Markup(f"{number(value, 8)}&nbsp;{unit}") if "frequency" in name else quantity(value, unit, 8)
        case [int() | float() as only]:
            return _value(name, only)
        case [int() | float(), *_] if len(value) > 9:
            rows = Markup(" ").join(number(each, 6) for each in value)
            return Markup("<details><summary>{} numbers</summary>{}</details>").format(len(value), rows)
        case [*entries]:
            return Markup(", ").join(number(each, 6) if isinstance(each, float) else each for each in entries)
    return escape(value)

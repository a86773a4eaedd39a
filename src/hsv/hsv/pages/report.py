"""The report of recorded flights: a self-contained HTML page."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.bags.reader import Bag
from hsv.base.errors import DesignError, DocumentError, RecordingError
from hsv.base.files import parse_json
from hsv.base.units import UnitSystem
from hsv.control.design_file import find_design, read_parameters
from hsv.flight.flight import step_times_in_words
from hsv.flight.limits import criteria_not_judged, limits_kept, missed, verdict_sentence
from hsv.flight.metrics import CRITERIA, grouped, spaced
from hsv.flight.requirement import SIGNALS
from hsv.flight.scenario import scenario_names
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.model.faults.injector import NEVER_TIME
from hsv.model.vehicle import SHIPPED_VEHICLES, named_parameters
from hsv.pages.engine import Numbers, Plot, render, write_page
from hsv.pages.events import Event
from hsv.pages.flights import DrawnCurve, ReportedRun, reported_runs
from hsv.pages.fly import SITE, fragment
from hsv.pages.panels import GROUPS, Kind, Panel
from hsv.pages.picture import DRAWN, Picture, picture
from hsv.pages.side_view import geometry
from hsv.pages.text import capitalised, number, quantity, shell, switched

DECLARED = {p.name: p for table in (LOCKSTEP_PARAMETERS, *NODE_PARAMETERS.values()) for p in table}
"""Declarations of all parameters of the nodes by name."""

EVENTS_SHOWN = 200
"""Maximum number of listed events of a run; the page states how many are left out."""

PICTURED = ("altitude", "velocity", "angle_of_attack", "level")
"""Panels of the picture at the top of the page."""


def write_report(bags: Sequence[Bag], out: Path, *, units: UnitSystem = UnitSystem.metric) -> None:
    """Write the report of ``bags``, with common plots, to the HTML file ``out``; ``units`` are its initial units.

    Raises:
        RecordingError: A bag holds no flight, or the file cannot be written.
    """
    write_page(report_page(reported_runs(bags), units=units), out, RecordingError)


def report_page(runs: Sequence[ReportedRun], *, units: UnitSystem = UnitSystem.metric) -> str:
    """Return the report of ``runs`` as an HTML page; ``units`` are its initial units."""
    numbers = Numbers()
    plots = [*_required(runs, numbers), *(_plot(panel, runs, numbers) for panel in all_panels(runs))]
    drawn = {plot.group for plot in plots}
    groups = {key: heading for key, heading in GROUPS.items() if key in drawn}
    sections = {"summary": "Summary", "metrics": "Metrics", "events": "Events", "vehicle": "Vehicle"}
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
        verdict=verdict,
        missed=missed,
        step_times=step_times_in_words,
        picture=_picture(runs, plots, numbers),
        effectors=any(curve.kind is Kind.effector for run in runs for c in run.curves.curves.values() for curve in c),
        criteria=CRITERIA,
        metrics=(shown := grouped(name for run in runs for name in (*run.metrics, *run.verdicts, *run.missing))),
        differing={n for named in shown.values() for n in named if len({run.metrics.get(n) for run in runs}) > 1},
        parameters={part: list(_parameters(part, runs)) for part in ("scenario", "design")},
        shipped_scenarios=scenario_names(),
        set_options=_set_options,
        fragment=fragment,
        site=SITE,
        events_shown=EVENTS_SHOWN,
        airframe=geometry(),
    )


def all_panels(runs: Sequence[ReportedRun]) -> list[Panel]:
    """Return the panels of all ``runs`` in the order of the page."""
    most = max(runs, key=lambda run: len(run.curves.panels))
    return list({name: panel for run in (most, *runs) for name, panel in run.curves.panels.items()}.values())


def sentence(runs: Sequence[ReportedRun]) -> Markup:
    """Return the verdict on one or several flights as HTML in all systems of units."""
    if len(runs) == 1:
        return verdict(runs[0])
    return switched({system: str(escape(f"{capitalised(_several(runs, system))}.")) for system in UnitSystem})


def verdict(run: ReportedRun) -> Markup:
    """Return the verdict on one flight as HTML in all systems of units."""
    texts = {
        system: _one(run, verdict_sentence(run.verdicts, run.metrics, system, run.disk_margin)) for system in UnitSystem
    }
    return switched({system: str(escape(f"{capitalised(text)}.")) for system, text in texts.items()})


def _several(runs: Sequence[ReportedRun], system: UnitSystem) -> str:
    judged = [run for run in runs if run.judged or run.failure]
    if not judged:
        return "there are no limits to judge these flights by"
    good = sum(run.good for run in judged)
    which = " that have limits" if len(judged) < len(runs) else ""
    parts = [f"within all of their limits: {good} of {len(judged)} flights{which}"]
    parts += [
        f"{run.label}: {_one(run, limits_kept(run.verdicts, system, run.disk_margin))}"
        for run in judged
        if not run.good
    ]
    for run in judged:
        if free := criteria_not_judged(run.verdicts, run.metrics, system):
            parts.append(f"{run.label}: not judged: {', '.join(free)}")
    return "; ".join(parts)


def _one(run: ReportedRun, limits: str) -> str:
    """Return ``limits`` or, without a scenario, the reason why there is none; with notes on loss and missing steps."""
    parts = [f"lost: {run.failure}"] if run.failure else []
    parts.append(limits if run.scenario else run.remark)
    if run.incomplete:
        parts.append(f"recorded are {run.incomplete}")
    return "; ".join(parts)


def _plot(panel: Panel, runs: Sequence[ReportedRun], numbers: Numbers) -> Plot:
    """Return the plot of a panel with the curves of all runs; equal references and bounds are drawn once."""
    curves: list[dict[str, Any]] = []
    # The run with the largest range is drawn first, so that it does not hide the others.
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


def _required(runs: Sequence[ReportedRun], numbers: Numbers) -> list[Plot]:
    """Return a plot of each signal that requirements bound.

    A bound is drawn over its window; at the deciding instant, a line leads from it to the signal.
    """
    plots = []
    for name in dict.fromkeys(name for run in runs for name in run.required):
        curves = []
        for index, run in enumerate(runs):
            if name in run.required:
                x, y = map(numbers.add, run.required[name])
                curves.append({"kind": Kind.actual, "label": run.label, "run": index, "x": x, "y": y})
            for row in run.description["requirements"] or ():
                if row["signal"] == name and row["decided_at_s"] is not None:
                    at, bound = row["decided_at_s"], row["bound"]
                    x = numbers.add(np.array([row["from_s"], at, at, at, row["to_s"]]))
                    y = numbers.add(np.array([bound, bound, row["value"], bound, bound]))
                    curves.append({"kind": Kind.bound, "label": row["name"], "run": index, "x": x, "y": y})
        title = capitalised(spaced(name))
        plots.append(Plot(f"required_{name}", title, SIGNALS[name].unit, "requirements", curves))
    return plots


def _actual(panel: Panel, runs: Sequence[ReportedRun]) -> list[np.ndarray | None]:
    return [run.curves.actual(panel.name) for run in runs]


def _agreed(curve: DrawnCurve, panel: Panel, runs: Sequence[ReportedRun]) -> bool:
    """Return whether ``curve`` is the same in all flights that have it."""
    drawn = [other for run in runs for other in run.curves.curves.get(panel.name, ()) if other.label == curve.label]
    return all(np.array_equal(other.y, curve.y) for other in drawn)


def _faults(run: ReportedRun) -> list[dict[str, Any]]:
    """Return the faults of a run for playback on the page: ``channel``, ``text``, and ``from`` and ``to`` (s)."""
    return [
        {
            "channel": fault["channel"],
            "text": f"{spaced(fault['channel'])}: {spaced(fault['type'])}",
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


def _picture(runs: Sequence[ReportedRun], plots: Sequence[Plot], numbers: Numbers) -> Picture:
    """Return the picture of the flights, with the nominal trajectory only if there is a single flight."""
    end = max(run.duration for run in runs) or 1.0
    faults = [event for run in runs for event in run.events if event.kind == "fault"]
    shades = sorted({(event.start, end if event.end is None else event.end) for event in faults})
    pictured = sorted((plot for plot in plots if plot.name in PICTURED), key=lambda plot: PICTURED.index(plot.name))
    kinds = DRAWN if len(runs) == 1 else [kind for kind in DRAWN if kind != Kind.nominal]
    return picture(pictured, numbers, end, shades, kinds=kinds)


def _parameters(part: str, runs: Sequence[ReportedRun]) -> Iterator[tuple[str, str, list[Markup]]]:
    """Yield each parameter that differs between the runs: its name, its description, and its values, one per run.

    For a single run, these are the parameters that differ from their defaults.
    """
    tables = [run.parameters[part] for run in runs]
    defaults = _defaults(tables[0]) if len(runs) == 1 else tables[0]
    for name in dict.fromkeys(name for table in tables for name in table):
        values = [table.get(name) for table in tables]
        if any(value != defaults.get(name) for value in values):
            yield name, DECLARED[name].description if name in DECLARED else "", [_value(name, v) for v in values]


def _defaults(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the default of each parameter, taken from the vehicle and the design that ``values`` names, if known."""
    defaults: dict[str, Any] = {name: parameter.default for name, parameter in DECLARED.items()}
    if str(values.get("vehicle.name")) in SHIPPED_VEHICLES:
        defaults |= named_parameters(values)
    design = str(values.get("design.name"))
    if re.fullmatch(r"[\w-]{1,100}", design):  # a path from a bag is not opened
        with suppress(DesignError):
            defaults |= read_parameters(find_design(design))
    return defaults


def _set_options(run: ReportedRun) -> str:
    """Return the options of a command that change the scenario's file as for this run, with a space before each."""
    with suppress(DocumentError):
        changes = parse_json(run.custom.get("set", "[]"))
        return "".join(f" --set {shell(change)}" for change in changes) if isinstance(changes, list) else ""
    return ""


def _value(name: str, value: Any) -> Markup:
    """Return the value of a parameter as HTML; long lists of numbers are collapsed."""
    unit = (DECLARED[name].unit if name in DECLARED else "") or "1"
    match value:
        case None | "" | []:
            return Markup("–")
        case bool():
            return Markup("yes" if value else "no")
        case float() if value == NEVER_TIME:
            return Markup("never")
        case int() | float():
            # Frequencies have the same unit in all systems of units.
            return Markup(f"{number(value, 8)}&nbsp;{unit}") if "frequency" in name else quantity(value, unit, 8)
        case [int() | float() as only]:
            return _value(name, only)
        case [int() | float(), *_] if len(value) > 9:
            rows = Markup(" ").join(number(each, 6) for each in value)
            return Markup("<details><summary>{} numbers</summary>{}</details>").format(len(value), rows)
        case [*entries]:
            return Markup(", ").join(number(each, 6) if isinstance(each, float) else each for each in entries)
    return escape(value)

"""Opening of a report: the verdict in one sentence, the events, and one picture of the flight."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from markupsafe import Markup, escape

from hsv.base.units import UnitSystem
from hsv.flight.limits import criteria_not_judged, limits_kept, verdict_sentence
from hsv.flight.metrics import in_words
from hsv.pages.report.differences import NEARLY, Difference
from hsv.pages.report.panels import Kind
from hsv.pages.report.picture import Line, Picture, TimePlot, picture, time_plot
from hsv.pages.report.run import ReportedRun
from hsv.pages.report.text import capitalised, number, percent, switched

PICTURED = ("altitude", "velocity", "angle_of_attack", "level")
"""Panels that the picture is made of."""

RUN_COLOURS = 6

_LOOKS = {Kind.actual: "", Kind.nominal: "nominal", Kind.reference: "reference", Kind.bound: "bound"}


def sentence(runs: Sequence[ReportedRun]) -> Markup:
    """Return the verdict on one flight, or on several, in all systems of units."""
    return switched({system: str(escape(f"{capitalised(_verdict(runs, system))}.")) for system in UnitSystem})


def _verdict(runs: Sequence[ReportedRun], system: UnitSystem) -> str:
    if len(runs) == 1:
        (run,) = runs
        return _whole(run, verdict_sentence(run.verdicts, run.metrics, system))
    judged = [run for run in runs if run.verdicts or run.failure]
    if not judged:
        return "there are no limits to judge these flights by"
    good = [run for run in judged if run.good]
    which = " that have limits" if len(judged) < len(runs) else ""
    parts = [f"within all of their limits: {len(good)} of {len(judged)} flights{which}"]
    parts += [f"{run.label}: {_whole(run, limits_kept(run.verdicts, system))}" for run in judged if not run.good]
    for run in judged:
        if free := criteria_not_judged(run.verdicts, run.metrics, system):
            parts.append(f"{run.label}: not judged: {', '.join(free)}")
    return "; ".join(parts)


def verdict(run: ReportedRun) -> Markup:
    """Return the verdict on one flight among several, in all systems of units."""
    said = {system: _whole(run, verdict_sentence(run.verdicts, run.metrics, system)) for system in UnitSystem}
    return switched({system: str(escape(text)) for system, text in said.items()})


def _whole(run: ReportedRun, said: str) -> str:
    """Return a verdict with what else makes a flight good or not: whether it ended early or is not recorded whole."""
    parts = [f"lost: {run.failure}"] if run.failure else []
    parts.append(said if run.scenario else run.remark)
    if run.incomplete:
        parts.append(f"recorded are {run.incomplete}")
    return "; ".join(parts)


def happened(runs: Sequence[ReportedRun], found: Sequence[Difference]) -> str:
    """Return what happened in one flight, or how far several agree; empty where nothing is known of that."""
    said = (_faults(runs[0]), *_tube(runs[0])) if len(runs) == 1 else tuple(_agreement(found))
    return f"{capitalised('; '.join(said))}." if said else ""


def _agreement(found: Sequence[Difference]) -> Iterator[str]:
    if not found:
        return
    share, title = max((run.share, difference.panel.title) for difference in found for run in difference.runs)
    if all(difference.none for difference in found):
        yield "states and commands are the same, bit for bit"
    elif share <= NEARLY:
        yield f"the flights nearly agree: no quantity differs by more than {percent(share)} of its range"
    elif np.isfinite(share):
        most = f"{percent(share)} of" if share < 1.0 else f"{number(share, 2)} times"
        yield f"the flights differ most in {title[0].lower()}{title[1:]}, by {most} its range"


def _faults(run: ReportedRun) -> str:
    faults = run.description["faults"] or ()
    if not faults:
        return "no fault"
    first = faults[0]
    more = f" and {len(faults) - 1} more" if len(faults) > 1 else ""
    return f"{in_words(first['type'])} of the {in_words(first['channel'])} from {number(first['start_s'])} s{more}"


def _tube(run: ReportedRun) -> Iterator[str]:
    tube = run.description["tube"]
    if tube and tube["checked_steps"]:
        outside, checked = tube["outside_steps"], tube["checked_steps"]
        where = f"left the invariant set in {outside} of {checked} steps" if outside else "stayed in the invariant set"
        yield f"the error {where}, largest level {number(tube['largest_level'], 3)}"


def flight_picture(runs: Sequence[ReportedRun]) -> Picture:
    """Return the picture of the flights: altitude, velocity, angle of attack and the level of the error."""
    end = max(run.duration for run in runs) or 1.0
    faults = {
        (event.start, end if event.end is None else event.end)
        for run in runs
        for event in run.events
        if event.kind == "fault"
    }
    return picture(list(_time_plots(runs, end)), end, sorted(faults))


def _time_plots(runs: Sequence[ReportedRun], end: float) -> Iterator[TimePlot]:
    for name in PICTURED:
        panel = next((panel for run in runs for panel in run.curves.panels if panel.name == name), None)
        if panel is not None:
            yield time_plot(panel.title, panel.unit, end, list(_lines(name, runs)))


def _lines(name: str, runs: Sequence[ReportedRun]) -> Iterator[Line]:
    """Yield what is drawn of a panel: the flights above all else, the nominal trajectory of one flight only."""
    drawn = [(index, run, curve) for index, run in enumerate(runs) for curve in run.curves.curves.get(name, ())]
    wanted = (Kind.bound, Kind.reference, *((Kind.nominal,) if len(runs) == 1 else ()), Kind.actual)
    seen: list[np.ndarray] = []
    for kind in wanted:
        for index, run, curve in drawn:
            if curve.kind is not kind or any(np.array_equal(curve.y, y) for y in seen if kind is not Kind.actual):
                continue
            seen.append(curve.y)
            time = run.curves.time if len(curve.y) == len(run.curves.time) else run.curves.time[[0, -1]]
            own = kind in (Kind.actual, Kind.nominal)
            look = f"run{index % RUN_COLOURS} {_LOOKS[kind]}".strip() if own else _LOOKS[kind]
            yield Line(look, time, curve.y, index if own else None)

"""What a report opens with: the verdict in one sentence, and one picture of the flight."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hsv.recording.report.differences import NEARLY, Difference
from hsv.recording.report.panels import Kind
from hsv.recording.report.picture import Line, Picture, TimePlot, picture, time_plot
from hsv.recording.report.run import ReportedRun
from hsv.recording.report.text import number, percent, words

PICTURED = ("altitude", "velocity", "angle_of_attack", "level")
"""Panels that the picture is made of."""

RUN_COLOURS = 6

_LOOKS = {Kind.actual: "", Kind.nominal: "nominal", Kind.reference: "reference", Kind.bound: "bound"}


def sentence(runs: Sequence[ReportedRun], found: Sequence[Difference]) -> str:
    """Return the verdict on one flight, or on several and how far they agree."""
    if len(runs) == 1:
        return f"{_verdict(runs[0])}{_faults(runs[0])}{_tube(runs[0])}."
    judged = [run for run in runs if run.verdicts or run.failure]
    parts = []
    if judged:
        good = [run for run in judged if run.good]
        parts.append(f"{len(good)} of {len(judged)} flights are within all of their limits")
        parts += [f"{run.label}: {_verdict(run)[0].lower()}{_verdict(run)[1:]}" for run in judged if not run.good]
    else:
        parts.append("There are no limits to judge these flights by")
    return "; ".join([*parts, *_agreement(found)]) + "."


def _agreement(found: Sequence[Difference]) -> Iterator[str]:
    if not found:
        return
    share, title = max((run.share, difference.panel.title) for difference in found for run in difference.runs)
    if all(difference.none for difference in found):
        yield "states and commands are the same, bit for bit"
    elif share <= NEARLY:
        yield f"they nearly agree: no quantity differs by more than {percent(share)} of its range"
    elif np.isfinite(share):
        yield f"they differ most in {title[0].lower()}{title[1:]}, by {percent(share)} of its range"


def _verdict(run: ReportedRun) -> str:
    over = [words(name) for name, verdict in run.verdicts.items() if not verdict.within]
    if run.failure:
        return f"Lost: {run.failure}"
    if over:
        return f"Not within its limits: {', '.join(over)} ({len(over)} of {len(run.verdicts)})"
    if not run.verdicts:
        return "There are no limits to judge this flight by"
    limits = f"all {len(run.verdicts)} limits" if len(run.verdicts) > 1 else "its limit"
    return f"Within {limits}{f' in what is recorded: {run.incomplete}' if run.incomplete else ''}"


def _faults(run: ReportedRun) -> str:
    faults = run.description["faults"] or ()
    if not faults:
        return ", without a fault"
    first = faults[0]
    more = f" and {len(faults) - 1} more" if len(faults) > 1 else ""
    return f", with {words(first['type'])} of the {words(first['channel'])} from {number(first['start_s'])} s{more}"


def _tube(run: ReportedRun) -> str:
    tube = run.description["tube"]
    if not tube or not tube["checked_steps"]:
        return ""
    level = f"largest level {number(tube['largest_level'], 3)}"
    if tube["outside_steps"]:
        return (
            f"; the error left the invariant set in {tube['outside_steps']} of {tube['checked_steps']} steps, {level}"
        )
    return f"; the error stayed in the invariant set, {level}"


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

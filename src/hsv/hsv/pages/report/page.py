"""The report as one HTML page that asks nothing of the network: style, script, plotting library and data inside."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup

from hsv.bags.reader import Bag
from hsv.base.errors import RecordingError
from hsv.base.units import UnitSystem
from hsv.flight.metrics import CRITERIA, METRICS, Group, Metric
from hsv.flight.scenario import scenario_names
from hsv.pages.report.comparison import comparisons, differing_metrics
from hsv.pages.report.differences import differences
from hsv.pages.report.opening import flight_picture, happened, sentence, verdict
from hsv.pages.report.panels import GROUPS, OF_EQUIPMENT, Kind
from hsv.pages.report.payload import all_panels, compressed, payload
from hsv.pages.report.run import ReportedRun, reported_runs
from hsv.pages.report.templates import LIBRARY, environment_of
from hsv.pages.report.values import Quantity, Section, Table

EVENTS_SHOWN = 200
"""Events of a run that are listed; of a run with more, the page says how many there are."""


def write_report(bags: Sequence[Bag], out: Path, *, units: UnitSystem = UnitSystem.metric) -> None:
    """Write the report of ``bags``, laid over one another, to the HTML file ``out``.

    Args:
        bags: One flight or several, which are then compared.
        out: File to write.
        units: Initial units of the page; they can be switched there.

    Raises:
        RecordingError: A bag holds no flight, or the file cannot be written.
    """
    page = render(reported_runs(bags), units=units)
    try:
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        if out.is_file():
            out.unlink()  # half a page
        raise RecordingError(f"{out}: cannot be written ({error.strerror}), expected an HTML file to write") from None


def render(runs: Sequence[ReportedRun], *, units: UnitSystem = UnitSystem.metric) -> str:
    """Return the page."""
    environment = environment_of("hsv.pages.report")
    environment.tests |= {
        "quantity": lambda value: isinstance(value, Quantity),
        "table": lambda value: isinstance(value, Table),
        "section": lambda value: isinstance(value, Section),
    }
    found = differences(runs)
    plots, numbers = payload(runs, found)
    panels = all_panels(runs)
    drawn = {panel.group for panel in panels}
    groups = {key: heading for key, heading in GROUPS.items() if key not in OF_EQUIPMENT or key in drawn}
    sections = {"summary": "Summary", "metrics": "Metrics", "events": "Events", "vehicle": "Vehicle"}
    if found:
        sections["differences"] = "Differences"
    sections |= groups | {"parameters": "Parameters", "certificate": "Certificate", "repeat": "Repeat"}
    return environment.get_template("page.html.j2").render(
        runs=runs,
        units=units,
        sections=sections,
        sentence=sentence(runs),
        happened=happened(runs, found),
        verdict=verdict,
        criteria=CRITERIA,
        picture=flight_picture(runs),
        differences=found,
        differing=differing_metrics(runs),
        groups=groups,
        panels=panels,
        effectors=any(curve["kind"] == Kind.effector for panel in plots["panels"] for curve in panel["curves"]),
        metrics=_grouped(runs),
        comparisons=comparisons(runs),
        shipped_scenarios=scenario_names(),
        events_shown=EVENTS_SHOWN,
        plots=plots,
        numbers=Markup(numbers),
        library=Markup(compressed(LIBRARY.read_bytes())),
    )


def _grouped(runs: Sequence[ReportedRun]) -> dict[Group, dict[str, Metric]]:
    """Return the metrics that any of the runs defines or is judged by, by what they tell about."""
    known = {name for run in runs for name in (*run.metrics, *run.verdicts)}
    groups = {
        group: {name: metric for name, metric in METRICS.items() if metric.group is group and name in known}
        for group in Group
    }
    return {group: metrics for group, metrics in groups.items() if metrics}

"""The report as one HTML page that asks nothing of the network: style, script, plotting library and data inside."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from markupsafe import Markup

from hsv.errors import RecordingError
from hsv.recording.reader import Bag
from hsv.recording.report import text
from hsv.recording.report.comparison import comparisons
from hsv.recording.report.panels import GROUPS, OF_EQUIPMENT, Kind
from hsv.recording.report.payload import all_panels, compressed, payload
from hsv.recording.report.run import ReportedRun, reported_runs
from hsv.recording.report.templates import environment_of
from hsv.recording.report.values import Quantity, Section, Table
from hsv.simulation.metrics import METRICS
from hsv.simulation.scenario import scenario_names

LIBRARY = files("hsv.recording.report").joinpath("plotly", "plotly-basic.min.js")
"""The plotting library; see the README beside it."""

EVENTS_SHOWN = 200
"""Events of a run that are listed; of a run with more, the page says how many there are."""


def write_report(bags: Sequence[Bag], out: Path, *, paper_units: bool = False) -> None:
    """Write the report of ``bags``, laid over one another, to the HTML file ``out``.

    Args:
        bags: One flight or several, which are then compared.
        out: File to write.
        paper_units: Whether the page opens in the paper's units; it can be switched there.

    Raises:
        RecordingError: A bag holds no flight, or the file cannot be written.
    """
    page = render(reported_runs(bags), paper_units=paper_units)
    try:
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        if out.is_file():
            out.unlink()  # half a page
        raise RecordingError(f"{out}: cannot be written ({error.strerror}), expected an HTML file to write") from None


def render(runs: Sequence[ReportedRun], *, paper_units: bool = False) -> str:
    """Return the page."""
    environment = environment_of("hsv.recording.report")
    environment.tests |= {
        "quantity": lambda value: isinstance(value, Quantity),
        "table": lambda value: isinstance(value, Table),
        "section": lambda value: isinstance(value, Section),
    }
    plots, numbers = payload(runs)
    panels = all_panels(runs)
    drawn = {panel.group for panel in panels}
    return environment.get_template("page.html.j2").render(
        runs=runs,
        paper_units=paper_units,
        groups={key: heading for key, heading in GROUPS.items() if key not in OF_EQUIPMENT or key in drawn},
        panels=panels,
        effectors=any(curve["kind"] == Kind.effector for panel in plots["panels"] for curve in panel["curves"]),
        metrics={name: metric for name, metric in METRICS.items() if any(name in run.metrics for run in runs)},
        comparisons=comparisons(runs),
        shipped_scenarios=scenario_names(),
        events_shown=EVENTS_SHOWN,
        quantity=text.quantity,
        unit=text.unit,
        style=_asset("style.css"),
        scripts=[_asset(name) for name in ("charts.js", "side_view.js", "player.js", "page.js")],
        plots=plots,
        numbers=Markup(numbers),
        library=Markup(compressed(LIBRARY.read_bytes())),
    )


def _asset(name: str) -> Markup:
    return Markup(files("hsv.recording.report").joinpath("template", name).read_text(encoding="utf-8"))

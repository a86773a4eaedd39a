"""Data of recorded flights for a report: description, metrics, verdicts, events, parameters and curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hsv.bags.description import STATE, TUBE_STATUS
from hsv.bags.flight import (
    effectors,
    equipment_topics,
    flight_data,
    labels,
    measurement_errors,
    moving_air,
    published_levels,
)
from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.bags.steps import completeness, joined
from hsv.base.errors import HsvError
from hsv.control.design_file import parse_parameters
from hsv.flight.limits import Verdict, missed, verdicts
from hsv.flight.metrics import FlightData
from hsv.flight.requirement import LEVEL, SIGNALS
from hsv.flight.scenario import Scenario, parse_scenario
from hsv.model.signals import INPUT_NAMES
from hsv.pages.events import Event, flight_events
from hsv.pages.panels import AIR_PANELS, MEASUREMENT_ERRORS, PANELS, Kind, Panel, error_panel


@dataclass(frozen=True)
class DrawnCurve:
    """A curve of a flight: y (SI) at all n steps, shape (n,); of a constant bound only first and last, shape (2,)."""

    kind: Kind
    label: str
    y: np.ndarray


@dataclass(frozen=True)
class FlightCurves:
    """The curves of a flight: time (s), shape (n,); panels by name, in the order of the page; curves by panel name."""

    time: np.ndarray
    panels: dict[str, Panel] = field(default_factory=dict)
    curves: dict[str, list[DrawnCurve]] = field(default_factory=dict)

    def add(self, panel: Panel, *curves: DrawnCurve) -> None:
        """Add a panel with its curves; a panel of elastic states that are always zero (rigid vehicle) is left out."""
        if panel.group == "elastic" and not any(curve.y.any() for curve in curves):
            return
        self.panels[panel.name] = panel
        self.curves[panel.name] = list(curves)

    def over(self, curve: DrawnCurve) -> np.ndarray:
        """Return the times (s) of the values of ``curve``."""
        return self.time if len(curve.y) == len(self.time) else self.time[[0, -1]]

    def actual(self, name: str) -> np.ndarray | None:
        """Return the values of the first curve of kind ``actual`` in the panel ``name``, or None if there is none."""
        return next((curve.y for curve in self.curves.get(name, ()) if curve.kind is Kind.actual), None)


@dataclass(frozen=True)
class ReportedRun:
    """A recorded flight in a report."""

    label: str
    description: dict[str, Any]
    """See :func:`hsv.bags.info.describe`."""
    texts: dict[str, str]
    """Attached texts by file name; empty if the bag does not have them."""
    scenario: Scenario | None
    """Scenario of the flight; None if the bag has no readable one, for the reason in :attr:`remark`."""
    remark: str
    metrics: dict[str, float]
    missing: dict[str, str]
    """The reason for each metric that the flight does not define, by name."""
    verdicts: dict[str, Verdict]
    curves: FlightCurves
    events: list[Event]
    parameters: dict[str, dict[str, Any]]
    """Parameters in the bag by name, under the keys ``scenario`` and ``design``."""
    required: dict[str, tuple[np.ndarray, np.ndarray]]
    """Times (s) and values (SI) of the signals that requirements bound, by name"""
    incomplete: str
    """The number of complete steps and the number of all steps, as text; empty if the bag is complete."""

    @property
    def custom(self) -> dict[str, str]:
        """Custom data that the recorder has written: run id, commit, design and its hash, ..."""
        return dict(self.description["custom_data"])

    @property
    def duration(self) -> float:
        """Simulated time of the last step in seconds."""
        return float(self.curves.time[-1])

    @property
    def failure(self) -> str:
        """Reason why the flight did not finish; empty if it did."""
        return next((event.text for event in self.events if event.kind == "error" and event.subject == "plant"), "")

    @property
    def good(self) -> bool:
        """Whether the flight is completely recorded and finished within every limit."""
        within = not missed(self.disk_margin) and all(verdict.kept for verdict in self.verdicts.values())
        return within and not self.failure and not self.incomplete

    @property
    def disk_margin(self) -> dict[str, Any] | None:
        """The verdict on the disk margin of the design, see :func:`hsv.flight.margins.margin_verdict`."""
        found: dict[str, Any] | None = self.description["disk_margin"]
        return found

    @property
    def judged(self) -> bool:
        """Whether there is a limit to judge the flight by."""
        return bool(self.verdicts or self.disk_margin)

    @property
    def input_limits(self) -> dict[str, tuple[float, float]]:
        """Minimum and maximum (SI) that the design permits, by input name; empty without a design."""
        design = self.parameters["design"]
        ends = zip(design.get("input.minimum", []), design.get("input.maximum", []), strict=False)
        return dict(zip(INPUT_NAMES, ends, strict=False))


def reported_runs(bags: Sequence[Bag]) -> list[ReportedRun]:
    """Return the runs for a report, one for each of ``bags``, with distinct labels."""
    return [_reported_run(bag, label) for bag, label in zip(bags, labels(bags), strict=True)]


def _reported_run(bag: Bag, label: str) -> ReportedRun:
    curves = flight_curves(bag)
    description = describe(bag)
    data, finished, required = flight_data(bag), description["ending"] == "finished", description["requirements"] or ()
    metrics = data.metrics | {row["metric"]: row["margin"] for row in required}
    names = ("scenario.toml", "scenario.yaml", "design.yaml", "certificate.json")
    texts = {name: bag.attachments.get(name, b"").decode(errors="replace") for name in names}
    scenario, remark = _scenario(texts["scenario.toml"], bag.custom_data.get("scenario", label))
    return ReportedRun(
        label=label,
        description=description,
        texts=texts,
        scenario=scenario,
        remark=remark,
        metrics=metrics,
        missing=data.missing,
        verdicts=verdicts(scenario, metrics, data.missing, ended=finished) if scenario else {},
        curves=curves,
        events=flight_events(bag, description),
        parameters={
            part: parse_parameters(texts[f"{part}.yaml"], f"{bag.path}: {part}.yaml") if texts[f"{part}.yaml"] else {}
            for part in ("scenario", "design")
        },
        required={name: (data.time, _required(name, data, bag)) for name in {row["signal"]: None for row in required}},
        incomplete=completeness(bag),
    )


def _required(name: str, flight: FlightData, bag: Bag) -> np.ndarray:
    levels = published_levels(bag) if name == LEVEL else None
    return SIGNALS[name].along(flight) if levels is None else levels


def _scenario(text: str, name: str) -> tuple[Scenario | None, str]:
    if not text:
        return None, "no scenario is attached to the bag, so there are no limits to judge by: --scenario gives one"
    try:
        return parse_scenario(text, name), ""
    except HsvError as error:
        return None, f"the attached scenario cannot be read by this version: {error}"


def flight_curves(bag: Bag) -> FlightCurves:
    """Return the curves of a flight at the steps for which ``bag`` has a message of every drawn topic."""
    topics = dict.fromkeys(curve.topic for panel in PANELS for curve in panel.curves)
    topics |= dict.fromkeys(equipment_topics(bag))
    if TUBE_STATUS not in bag.roles:  # a custom controller has no tube
        del topics[TUBE_STATUS]
    columns = joined(bag, list(topics))
    flight = FlightCurves(columns[STATE]["header.stamp"] * 1e-9)

    # Without an invariant set, the tube status has no error.
    error = columns[TUBE_STATUS]["error"] if TUBE_STATUS in columns else ()
    components = np.asarray(error, float).reshape(len(flight.time), -1).shape[1]
    for panel in (*PANELS, *map(error_panel, range(components))):
        if not all(curve.topic in columns for curve in panel.curves):
            continue
        drawn = []
        for curve in panel.curves:
            y = np.broadcast_to(curve.value(columns[curve.topic].__getitem__), flight.time.shape)
            steady = curve.kind is Kind.bound and np.all(y == y[0])
            drawn.append(DrawnCurve(curve.kind, curve.label, y[[0, -1]] if steady else y))
        if np.isfinite(drawn[0].y).any():
            flight.add(panel, *(curve for curve in drawn if np.isfinite(curve.y).any()))
    for name, y in effectors(columns).items():
        flight.curves[name].append(DrawnCurve(Kind.effector, "effector", y))
    for name, y in measurement_errors(columns).items():
        flight.add(MEASUREMENT_ERRORS[name], DrawnCurve(Kind.actual, "measured less true", y))
    for name, y in moving_air(columns).items():
        flight.add(AIR_PANELS[name], DrawnCurve(Kind.actual, "air", y))
    if "level" in flight.curves:
        flight.curves["level"].append(DrawnCurve(Kind.bound, "edge of the set", np.ones(2)))
    return flight

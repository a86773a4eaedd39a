"""A recorded flight as the report tells it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hsv.bags.bag_warnings import completeness
from hsv.bags.flight import flight_data, labels
from hsv.bags.info import describe
from hsv.bags.infrastructure_parameters import LOCKSTEP_PARAMETERS
from hsv.bags.reader import Bag
from hsv.base.errors import DocumentError, HsvError, RecordingError
from hsv.base.files import parse_json
from hsv.control.design import parse_parameters
from hsv.flight.limits import Verdict, verdicts
from hsv.flight.metrics import flight_metrics
from hsv.flight.scenario import Scenario, parse_scenario
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv.pages.report.curves import FlightCurves, flight_curves
from hsv.pages.report.events import Event, flight_events
from hsv.pages.report.panels import INPUTS
from hsv.pages.report.values import Value, parameters, tree

DECLARED = {p.name: p for table in (LOCKSTEP_PARAMETERS, *NODE_PARAMETERS.values()) for p in table}
"""Every parameter of every node, by name."""


@dataclass(frozen=True)
class ReportedRun:
    """Everything the page says about one bag."""

    label: str
    description: dict[str, Any]
    scenario: Scenario | None
    """Scenario of the flight; None if the bag has none that can be read, and :attr:`remark` says why."""
    scenario_text: str
    remark: str
    metrics: dict[str, float]
    verdicts: dict[str, Verdict]
    curves: FlightCurves
    events: list[Event]
    parameters: dict[str, dict[str, Value]]
    """Parameters of the scenario and of the design."""
    input_limits: dict[str, tuple[float, float]]
    certificate: Value | None
    incomplete: str
    """Number of steps with all topics, and number of steps; empty if the bag is complete."""

    @property
    def custom(self) -> dict[str, str]:
        """Custom data that the recorder received about the run: run id, commit, design and its hash, ..."""
        return dict(self.description["custom_data"])

    @property
    def folder(self) -> Path:
        """The bag's folder."""
        return Path(self.description["folder"])

    @property
    def duration(self) -> float:
        """Simulated time of the last step, seconds."""
        return float(self.curves.time[-1])

    @property
    def failure(self) -> str:
        """Reason for which the flight did not finish; empty if it did."""
        return next((event.text for event in self.events if event.kind == "error" and event.subject == "plant"), "")

    @property
    def warnings(self) -> list[str]:
        """Warnings about what is missing in the bag."""
        return list(self.description["warnings"])

    @property
    def good(self) -> bool:
        """Whether the flight is recorded whole, and came to its end within every limit."""
        return not self.failure and not self.incomplete and all(verdict.within for verdict in self.verdicts.values())


def reported_runs(bags: Sequence[Bag]) -> list[ReportedRun]:
    """Return the runs of a report, one for each of ``bags``, with distinct labels.

    Raises:
        RecordingError: A bag holds no flight.
    """
    return [_reported_run(bag, label) for bag, label in zip(bags, labels(bags), strict=True)]


def _reported_run(bag: Bag, label: str) -> ReportedRun:
    curves = flight_curves(bag)
    description = describe(bag)
    metrics = flight_metrics(flight_data(bag))
    scenario_text = bag.attachments.get("scenario.toml", b"").decode(errors="replace")
    scenario, remark = _scenario(scenario_text, bag.custom_data.get("scenario", label))
    values = {name: _attached_parameters(bag, f"{name}.yaml") for name in ("scenario", "design")}
    return ReportedRun(
        label=label,
        description=description,
        scenario=scenario,
        scenario_text=scenario_text,
        remark=remark,
        metrics=metrics,
        verdicts=verdicts(scenario, metrics, ended=description["ending"] == "finished") if scenario else {},
        curves=curves,
        events=flight_events(bag, description),
        parameters={name: parameters(flat, DECLARED) for name, flat in values.items()},
        input_limits=_input_limits(values["design"]),
        certificate=_certificate(bag),
        incomplete=completeness(bag),
    )


def _scenario(text: str, name: str) -> tuple[Scenario | None, str]:
    if not text:
        return None, "no scenario is attached to the bag, so there are no limits to judge by: --scenario gives one"
    try:
        return parse_scenario(text, name), ""
    except HsvError as error:
        return None, f"the attached scenario cannot be read by this version: {error}"


def _attached_parameters(bag: Bag, name: str) -> dict[str, Any]:
    text = bag.attachments.get(name, b"").decode(errors="replace")
    return parse_parameters(text, f"{bag.path}: {name}") if text else {}


def _input_limits(design: dict[str, Any]) -> dict[str, tuple[float, float]]:
    low, high = design.get("input.minimum", []), design.get("input.maximum", [])
    return dict(zip(INPUTS, zip(low, high, strict=False), strict=False))


def _certificate(bag: Bag) -> Value | None:
    text = bag.attachments.get("certificate.json")
    try:
        return None if text is None else tree(parse_json(text))
    except DocumentError as error:
        raise RecordingError(f"{bag.path}: attached certificate.json: {error}") from None

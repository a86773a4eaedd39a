"""Everything in a scenario that the certificate of its design does not cover."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hsv.control.coverage import uncovered
from hsv.control.design import ControlDesign, certificate_path, find_design, read_certificate
from hsv.flight.scenario import Scenario


def uncovered_of(
    scenario: Scenario, design: ControlDesign | None, certificate: Mapping[str, Any] | None = None
) -> list[str]:
    """Return what of ``scenario`` no certificate covers, named, an entry a thing; empty where all of it is covered.

    Args:
        scenario: Flown; its faults are those that it schedules.
        design: With which it is flown.
        certificate: That of the design; where none is given, the one beside the scenario's design, if there is one.

    Raises:
        DesignError: The scenario's design is not there, or its certificate cannot be read.
    """
    if certificate is None and scenario.design:
        path = certificate_path(find_design(scenario.design))
        certificate = read_certificate(path) if path.is_file() else None
    values = {**(design.to_parameters() if design else {}), **scenario.parameters()}
    return uncovered(values, design, certificate, [(f.channel, f.type, f.parameters) for f in scenario.fault])

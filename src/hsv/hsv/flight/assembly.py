"""Assembly of the closed loop from flat parameters (values by dotted name), for simulation, checks and replay."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import PurePath
from typing import Any

from hsv.base.errors import HsvError, ParameterError, ScenarioError, TrimError
from hsv.base.parameters import table_values
from hsv.certificate.coverage import FlownFault, uncovered
from hsv.control.controller import NODE, SHIPPED_CONTROLLERS
from hsv.control.design import TAU, ControlDesign, design_of
from hsv.control.design_file import certificate_path, find_design, read_certificate, read_design, read_parameters
from hsv.flight.blocks import LOOP
from hsv.flight.closed_loop import Components
from hsv.flight.scenario import Scenario
from hsv.model.faults.injector import NEVER_TIME
from hsv.plugins.controllers import controller_class, names_code

_FIELDS = {
    r"^parameter feedback\.tau\b": "tube.tau",
    r"^parameter tau_change\.starts\b": "tube.change",
    r"^parameter tau_change\.values\b(\[\d+\])?": r"tube.change\1.tau",
    r"(parameter )?\bnotch\.flown\.": "notch.",
    r"^parameter (integral|robust_mpc)\.": r"\1.",
    r"^parameter reference\.blend\b": "reference.blend",
}
"""Patterns of parameter names in error messages, and the fields of a scenario that replace them."""


def scenario_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the flat parameters of ``scenario`` and of its custom controller, if any, importing its class."""
    return scenario.parameters() | own_parameters(scenario)


def own_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the custom controller's flat parameters, importing its class; empty for a shipped controller or a node."""
    if scenario.controller in SHIPPED_CONTROLLERS:
        return {}
    if scenario.controller.startswith(NODE):
        for table in scenario.own:
            raise ParameterError(f"{table}: unknown table, expected none: a node brings its own parameters")
        return {}
    return table_values(controller_class(scenario.controller).PARAMETERS, scenario.own)


def without_code(scenario: Scenario) -> Scenario:
    """Return ``scenario`` with a placeholder instead of a custom controller, whose code is thus not loaded.

    Commands that do not fly the controller assemble this scenario; it has the same vehicle, reference and faults.
    """
    shipped = scenario.controller in SHIPPED_CONTROLLERS
    return scenario if shipped else scenario.model_copy(update={"controller": NODE, "own": {}})


def design_parameters(scenario: Scenario) -> dict[str, Any]:
    """Check the design of ``scenario`` and return the parameters in its file; empty without a design."""
    if not scenario.design:
        return {}
    path = find_design(scenario.design)
    read_design(path)
    return read_parameters(path)


def flight_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the parameters of ``scenario`` and its design (the scenario's prevail); :func:`assemble` checks them."""
    return {**design_parameters(scenario), **scenario_parameters(scenario)}


def assemble(values: Mapping[str, Any]) -> Components:
    """Return the five components of the loop for flat parameters as files have them, those of a design included."""
    return assemble_with(design_of(values), values)


def assemble_with(design: ControlDesign | None, values: Mapping[str, Any]) -> Components:
    """Return the five components of the loop for a ``design`` and the flat parameters ``values`` of the flight."""
    complete = {**(design.loop_parameters if design else {}), **values}
    return Components(**{block.name: block.build(complete, design) for block in LOOP})


def assemble_flight(scenario: Scenario, design: ControlDesign | None = None) -> Components:
    """Return the components of the loop that flies ``scenario``, with ``design`` or else with the scenario's own.

    Raises:
        ScenarioError: A field or the design is wrong; the message names it.
    """
    with blamed_on(scenario):
        if design is None and scenario.design:
            design = read_design(find_design(scenario.design))
        own = scenario_parameters(scenario)
        if design and TAU.name in own:
            design = design.with_tau(own[TAU.name])
        components = assemble_with(design, own)
        check_times(scenario, components)
    return components


def check_times(scenario: Scenario, components: Components) -> None:
    """Raise a ScenarioError if the duration of ``scenario`` is no number of periods of its ``components``.

    The window of a requirement must last a period, so that it has a step.
    """
    plant, given = components.plant, f"duration = {scenario.duration:g} s"
    if plant.steps < 1:
        raise ScenarioError(f"{given}: expected at least a period, {plant.period:g} s")
    if abs(plant.steps * plant.period - scenario.duration) > 1e-9 * scenario.duration:
        raise ScenarioError(f"{given}: expected a whole number of periods, {plant.period:g} s each")
    for requirement in scenario.requirement:
        if requirement.within < plant.period:
            raise ScenarioError(
                f"requirement {requirement.name!r}: within = {requirement.within:g} s: an empty window, expected at "
                f"least a period, {plant.period:g} s"
            )


@contextmanager
def blamed_on(scenario: Scenario) -> Iterator[None]:
    """Turn an ``HsvError`` of this context into a ``ScenarioError`` that names a scenario's fields, not parameters."""
    try:
        yield
    except HsvError as error:
        text = str(error)
        for parameter, field in _FIELDS.items():
            text = re.sub(parameter, field, text)
        if isinstance(error, TrimError):
            text = f"{'command' if scenario.command else 'initial'}: {text}"
        raise ScenarioError(f"scenario {scenario.name!r}: {text}") from error


def uncovered_of(
    scenario: Scenario, design: ControlDesign | None, certificate: Mapping[str, Any] | None = None
) -> list[str]:
    """Return a message for each property of ``scenario`` that the certificate does not cover; empty if all are covered.

    Without a ``certificate``, that in the file next to the scenario's design is used, if that file exists.

    Raises:
        DesignError: No ``certificate`` is given, and the design does not exist or its certificate cannot be read.
    """
    if certificate is None and scenario.design:
        path = certificate_path(find_design(scenario.design))
        certificate = read_certificate(path) if path.is_file() else None
    values = {**(design.loop_parameters if design else {}), **scenario.parameters()}
    faults = [
        FlownFault(f.channel, f.type, f.parameters, f.start, NEVER_TIME if f.stop is None else f.stop)
        for f in scenario.fault
    ]
    return uncovered(values, design, certificate, faults)


def require_trust(controller: str, source: object, trust: bool) -> None:
    """Refuse custom code as the ``controller`` of the bag or campaign ``source``, unless the user passed ``--trust``.

    Custom code is a class, a library or an FMU. A registered name selects installed code, which is not refused.
    """
    if names_code(controller) and not trust:
        raise ParameterError(f"{source}: controller = {controller!r}: code that this file names, run only with --trust")


def require_path_inside(path: str, field: str, source: object, trust: bool) -> None:
    """Refuse an absolute ``path``, or one with ``..``, in the bag or campaign ``source``, unless the user trusts it."""
    if (PurePath(path).is_absolute() or ".." in PurePath(path).parts) and not trust:
        raise ParameterError(f"{source}: {field} = {path!r}: a path out of the folder, followed only with --trust")

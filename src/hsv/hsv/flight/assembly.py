"""Assembly of the loop from flat parameters, used by simulation, checks and replay."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from hsv.base.errors import DesignError, HsvError, ParameterError, ScenarioError, TrimError
from hsv.base.parameters import table_values
from hsv.control.controllers import NODE, SHIPPED_CONTROLLERS, controller_class
from hsv.control.design import TAU, ControlDesign, design_of, find_design, read_design, read_parameters
from hsv.flight.blocks import LOOP
from hsv.flight.closed_loop import Components
from hsv.flight.scenario import Scenario

_FIELDS = {
    r"^parameter feedback\.tau\b": "tube.tau",
    r"^parameter tau_change\.starts\b": "tube.change",
    r"^parameter tau_change\.values\b(\[\d+\])?": r"tube.change\1.tau",
    r"(parameter )?\bnotch\.flown\.": "notch.",
    r"^parameter (integral|robust_mpc)\.": r"\1.",
    r"^parameter reference\.blend\b": "reference.blend",
}
"""Parameters as a scenario calls them."""


def scenario_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the flat parameters of ``scenario``, those of a controller of one's own included, which is loaded.

    Raises:
        ParameterError, QuantityError: Names what the controller does not admit.
    """
    return scenario.parameters() | own_parameters(scenario)


def own_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the flat parameters of a controller of one's own, which is loaded; none of a shipped one, or of a node.

    Raises:
        ParameterError, QuantityError: Names what the controller does not admit.
    """
    if scenario.controller in SHIPPED_CONTROLLERS:
        return {}
    if scenario.controller.startswith(NODE):
        for table in scenario.own:
            raise ParameterError(f"{table}: unknown table, expected none: a node brings its own parameters")
        return {}
    return table_values(controller_class(scenario.controller).PARAMETERS, scenario.own)


def design_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the parameters in the file of the scenario's design, none where it has none.

    Raises:
        DesignError: There is no such design, or its file cannot be read.
    """
    return read_parameters(find_design(scenario.design)) if scenario.design else {}


def flight_parameters(scenario: Scenario) -> dict[str, Any]:
    """Return the design's parameters with those of ``scenario`` over them; :func:`assemble` checks them.

    Raises:
        DesignError, ParameterError, QuantityError: As above.
    """
    return {**design_parameters(scenario), **scenario_parameters(scenario)}


def assemble(values: Mapping[str, Any], design: ControlDesign | None = None) -> Components:
    """Return the five components that these parameters describe; each checks its own.

    ``design``: the one in ``values``, where it is known already.

    Raises:
        ParameterError, DesignError, TrimError: Names the parameter that is wrong.
    """
    design = design or design_of(values)
    return Components(**{block.name: block.build(values, design) for block in LOOP})


def assemble_flight(scenario: Scenario, design: ControlDesign | None = None) -> Components:
    """Return the components that fly ``scenario``, with ``design`` or, where none is given, with its own.

    Raises:
        ScenarioError: Names the field that is wrong, or what is wrong with the design.
    """
    with blamed_on(scenario, design_read=design is None):
        if design is None and scenario.design:
            design = read_design(find_design(scenario.design))
        own = scenario_parameters(scenario)
        if design and TAU.name in own:
            design = design.with_tau(own[TAU.name])
        components = assemble({**(design.to_parameters() if design else {}), **own}, design)
        plant = components.plant
        if plant.steps < 1:
            raise ScenarioError(f"duration = {scenario.duration:g} s: expected at least a period, {plant.period:g} s")
        if abs(plant.steps * plant.period - scenario.duration) > 1e-9 * scenario.duration:
            raise ScenarioError(
                f"duration = {scenario.duration:g} s: expected a whole number of periods, {plant.period:g} s each"
            )
    return components


@contextmanager
def blamed_on(scenario: Scenario, *, design_read: bool = True) -> Iterator[None]:
    """Turn errors of components into errors of ``scenario``, with its name and its names of the parameters.

    What is wrong with a design that is read, by itself, is said with its file.

    Raises:
        ScenarioError: In place of any other error of the library.
    """
    try:
        yield
    except HsvError as error:
        text = (design_read and isinstance(error, DesignError) and _wrong_in_file(scenario.design)) or str(error)
        for parameter, field in _FIELDS.items():
            text = re.sub(parameter, field, text)
        if isinstance(error, TrimError):
            text = f"{'command' if scenario.command else 'initial'}: {text}"
        raise ScenarioError(f"scenario {scenario.name!r}: {text}") from error


def _wrong_in_file(design: str) -> str:
    """Return what is wrong with a design whatever the scenario, with its file; nothing where that is not the reason."""
    try:
        read_design(find_design(design))
    except DesignError as error:
        return str(error)
    return ""

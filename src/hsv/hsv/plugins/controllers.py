"""Look up and build controllers, given by a registered name or by the place of their class or file.

A package registers its controllers as entry points of the group ``hsv.controllers``; in ``pyproject.toml``::

    [project.entry-points."hsv.controllers"]
    lqr = "hsv_lqr:Lqr"

A scenario then contains ``controller = "lqr"``, or ``controller = "package.module:Class"`` for a class without a
registered name; :mod:`hsv.control.controller` describes the class. A controller in C is
``controller = "path/lib.so:symbol"``, see :mod:`hsv.plugins.library`, and one in an FMU
``controller = "path/controller.fmu"``, see :mod:`hsv.plugins.fmu`.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hsv.base.errors import DesignError, HsvError, ParameterError, one_of
from hsv.base.parameters import Parameter, validate
from hsv.control.controller import (
    CONTROLLER_PARAMETERS,
    FOREIGN_FAILURES,
    NODE,
    SHIPPED_CONTROLLERS,
    Controller,
    ControllerClass,
    ExternalController,
    NodeController,
    StepKernel,
    failure_words,
)
from hsv.control.design import DESIGN_PARAMETERS, ControlDesign
from hsv.control.notch_filter import DESIGN_NOTCH_PARAMETERS
from hsv.model.vehicle import Vehicle
from hsv.plugins.fmu import FmuClass
from hsv.plugins.library import LibraryClass, library_digest, library_place

GROUP = "hsv.controllers"
"""Group of the entry points that register controllers."""

HIDDEN_PARAMETERS = (
    *("vehicle.perturbation.", "fault.", "seed"),
    *("actuator.", "wind.", "turbulence.", "gust.", "density.", "sensors.", "link."),
)
"""Prefixes of parameters that custom controllers do not receive: perturbations, faults and equipment. The numbers of a
design, too, are not among their parameters: they receive the design itself."""


def controller_names() -> list[str]:
    """Return the names of all registered controllers, in alphabetical order."""
    from importlib.metadata import entry_points  # slow

    return sorted({*SHIPPED_CONTROLLERS, *(entry.name for entry in entry_points(group=GROUP))})


def names_code(controller: str) -> bool:
    """Return whether ``controller`` is the place of a class, a library or an FMU, not a registered name or a node."""
    return library_place(controller) is not None or (":" in controller and not controller.startswith(NODE))


def controller_class(name: str) -> ControllerClass:
    """Return the class of the controller ``name``, or an object with its interface if it is in a library or an FMU.

    This is the only place that loads code which a file names. What flies calls it; other commands assemble the
    scenario of :func:`hsv.flight.assembly.without_code`.

    Raises:
        ParameterError: There is no such controller, or it cannot be loaded.
    """
    if library := library_place(name):
        path, symbol = library
        return LibraryClass(name, path, symbol) if symbol else FmuClass(name, path, symbol)
    place = class_place(name)
    module, _, attribute = place.partition(":")
    try:
        found = getattr(importlib.import_module(module), attribute)
    except SystemExit as error:
        raise ParameterError(f"controller = {name!r}: cannot be loaded, {module} ends the program on import") from error
    except Exception as error:
        words = failure_words(error)
        if isinstance(error, ModuleNotFoundError) and error.name == module:
            words += f" (PYTHONPATH=FOLDER:$PYTHONPATH finds {module}.py in FOLDER)"
        raise ParameterError(f"controller = {name!r}: cannot be loaded, {words}") from error
    lacking = [a for a in ("PARAMETERS", "from_parameters") if not hasattr(found, a)]
    if lacking:
        raise ParameterError(f"controller = {name!r}: has no {', '.join(lacking)}, expected a class of a controller")
    if not all(isinstance(parameter, Parameter) for parameter in found.PARAMETERS):
        raise ParameterError(f"controller = {name!r}: PARAMETERS: expected hsv.base.parameters.Parameter, each")
    return found


@dataclass(frozen=True)
class LibraryRecord:
    """Data about a controller library or FMU that are stored with a recorded flight."""

    sha256: str
    """SHA-256 of the library file, hexadecimal."""
    source_name: str
    """Path of the source relative to the library's folder, as given by the block; empty if unknown or missing."""
    source: bytes


def library_record(controller: str) -> LibraryRecord | None:
    """Return the data to store for a scenario's ``controller``, or None if it is not in a library or FMU.

    Raises:
        ParameterError: The library cannot be read or has no such controller.
    """
    place = library_place(controller)
    if place is None:
        return None
    path, symbol = place
    kind = controller_class(controller) if symbol else None
    name, source = kind.block.source if isinstance(kind, LibraryClass) else "", b""
    if name:
        try:
            source = (path.parent / name).read_bytes()
        except OSError:
            name = ""  # a flight does not need the source
    return LibraryRecord(library_digest(controller), name, source)


def class_place(name: str) -> str:
    """Return ``package.module:Class``, the place of the class of the controller ``name``, without loading it.

    A name that is a place itself, or that means a library, an FMU or a node, is returned unchanged.

    Raises:
        ParameterError: No controller is registered as ``name``, or it is malformed.
    """
    place = SHIPPED_CONTROLLERS.get(name, name)
    if library_place(place):
        return place
    module, colon, _ = place.partition(":")
    if colon:
        if not all(map(str.isidentifier, module.split("."))):
            raise ParameterError(
                f"controller = {name!r}: {module!r} is no module, expected package.module:Class or path/lib.so:symbol"
            )
        return place
    from importlib.metadata import entry_points  # slow

    for entry in entry_points(group=GROUP):
        if entry.name == name:
            return entry.value
    if "/" in name or name.endswith(".so"):
        raise ParameterError(f"controller = {name!r}: no symbol, expected path/lib.so:symbol, the path of a library")
    choices = one_of(controller_names(), name, ", package.module:Class, path/lib.so:symbol or path/name.fmu")
    raise ParameterError(f"controller = {name!r}: expected {choices}")


def build_controller(values: Mapping[str, Any], design: ControlDesign | None) -> Controller:
    """Return the controller that the flat parameters ``values`` describe; a placeholder if it is a node.

    Args:
        values: Flat parameters of the flight, of which the controller uses its own.
        design: Design of the flight, if it has one.

    Raises:
        ParameterError: There is no such controller, or it cannot be built.
        DesignError: There is no design, but the controller flies with its gains.
        HsvError: The class of the controller raised it, for example a DesignError.
    """
    name = str(validate(CONTROLLER_PARAMETERS, values)["controller"])
    if name.startswith(NODE):
        return NodeController(name)
    if design is None and name in SHIPPED_CONTROLLERS:
        raise DesignError(f"controller = {name!r}: no design, expected one with whose gains it flies")
    kind = controller_class(name)
    try:
        own = values
        if name not in SHIPPED_CONTROLLERS:
            hidden = {p.name for p in DESIGN_PARAMETERS} - {p.name for p in DESIGN_NOTCH_PARAMETERS}
            own = {
                parameter: value
                for parameter, value in values.items()
                if parameter not in hidden and not parameter.startswith(HIDDEN_PARAMETERS)
            }
        built = kind.from_parameters(own, design)
    except HsvError:
        raise
    except FOREIGN_FAILURES as error:
        raise ParameterError(f"controller = {name!r}: cannot be built, {failure_words(error)}") from error
    if isinstance(built, Controller):
        return built
    kernel = getattr(built, "kernel", None)
    if not isinstance(kernel, StepKernel | None):
        shown = " ".join(repr(kernel).split())[:80]
        raise ParameterError(f"controller = {name!r}: kernel = {shown}: expected a StepKernel")
    due = () if kernel is not None else ("reset", "step")
    if lacking := [attribute for attribute in due if not hasattr(built, attribute)]:
        raise ParameterError(f"controller = {name!r}: has no {', '.join(lacking)}, expected a controller")
    return ExternalController(name, built, Vehicle.from_parameters(values).decoupled)

"""Parameters of every node: of its component and of its infrastructure; and those that may change in flight."""

from __future__ import annotations

import re

from hsv.bags.description import (
    FAULT_INJECTOR,
    LIVE,
    NOMINAL_TRAJECTORY,
    NOTCH_FILTER,
    PLANT,
    RECORDER,
    ROBUST_MPC,
    TUBE_MPC,
    NodeDescription,
    graph,
)
from hsv.bags.infrastructure_parameters import LIVE_PARAMETERS, PACE_PARAMETERS, RECORDER_PARAMETERS
from hsv.base.errors import ParameterError, did_you_mean
from hsv.base.parameters import Parameter
from hsv.base.units import parse_quantity
from hsv.control.design import DESIGN_PARAMETERS
from hsv.control.design_file import CERTIFICATE_PARAMETERS
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import NotchFilter
from hsv.model.faults.injector import FaultInjector
from hsv.model.plant import Plant
from hsv.plugins.controllers import controller_class


def _designed(own: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    names = {parameter.name for parameter in own}
    return (*own, *(parameter for parameter in DESIGN_PARAMETERS if parameter.name not in names))


def own_parameters(controller: str) -> tuple[Parameter, ...]:
    """Return the parameters of the node that steps a controller; the controller's class is loaded."""
    return _designed(tuple(controller_class(controller).PARAMETERS))


NODE_PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    PLANT.name: (*Plant.PARAMETERS, *PACE_PARAMETERS),
    NOTCH_FILTER.name: NotchFilter.PARAMETERS,
    NOMINAL_TRAJECTORY.name: _designed(NominalTrajectory.PARAMETERS),
    TUBE_MPC.name: (*own_parameters(TUBE_MPC.name), *CERTIFICATE_PARAMETERS),
    ROBUST_MPC.name: own_parameters(ROBUST_MPC.name),
    FAULT_INJECTOR.name: FaultInjector.PARAMETERS,
    RECORDER.name: RECORDER_PARAMETERS,
    LIVE.name: LIVE_PARAMETERS,
}
"""Parameter tables by node, without those of custom controllers. Every node also declares
:data:`hsv.bags.infrastructure_parameters.LOCKSTEP_PARAMETERS`."""

SETTABLE: dict[str, tuple[NodeDescription, Parameter]] = {
    parameter.name: (node, parameter)
    for node in graph()
    for parameter in NODE_PARAMETERS[node.name]
    if not parameter.read_only
}
"""Parameters that may change in flight, by name, with the node that has them."""

_STEP = re.compile(r"from step (\d+) on")

_TRUTH = {"true": True, "false": False}


def find(name: str) -> tuple[NodeDescription, Parameter]:
    """Return (node, parameter) of a parameter that may change in flight, by its full name or the part after the dot."""
    found = [entry for full, entry in SETTABLE.items() if name in (full, full.rpartition(".")[2])]
    if len(found) != 1:
        names = ", ".join(SETTABLE) + did_you_mean(name, SETTABLE)
        raise ParameterError(f"name = {name!r}: expected a parameter that may change in flight, {names}")
    return found[0]


def parse(text: str, parameter: Parameter) -> bool | float | list[float]:
    """Return the value in ``text``, SI: true or false, or comma-separated numbers with units; brackets are optional."""
    if parameter.kind == "bool":
        return bool(parameter.check(_TRUTH.get(text.strip().lower(), text)))
    words = text.strip().removeprefix("[").removesuffix("]").split(",")
    values = [parse_quantity(word, parameter.unit or "1", parameter.name) for word in words]
    if parameter.kind == "double":
        return float(parameter.check(values[0] if len(values) == 1 else values))
    return list(parameter.check(values))


def step_in(answer: str) -> int:
    """Return the step at which a change takes effect, from the reply of a node."""
    step = _STEP.search(answer)
    assert step, "a parameter that may change in flight answers from which step on"
    return int(step[1])

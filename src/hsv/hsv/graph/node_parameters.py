"""Every parameter of every node: those of the block that it steps, and those of its part in the graph."""

from __future__ import annotations

from hsv.bags.description import LIVE, RECORDER, ROBUST_MPC, TUBE_MPC
from hsv.bags.infrastructure_parameters import LIVE_PARAMETERS, PACE_PARAMETERS, RECORDER_PARAMETERS
from hsv.base.parameters import Parameter
from hsv.control.controllers import controller_class
from hsv.control.design import CERTIFICATE_PARAMETERS, DESIGN_PARAMETERS
from hsv.flight.blocks import FAULT_INJECTOR, NOMINAL_TRAJECTORY, NOTCH_FILTER, VEHICLE


def _designed(own: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    names = {parameter.name for parameter in own}
    return (*own, *(parameter for parameter in DESIGN_PARAMETERS if parameter.name not in names))


def own_parameters(controller: str) -> tuple[Parameter, ...]:
    """Return the parameters of the node that flies a controller, whose class is loaded.

    Raises:
        ParameterError: There is no such controller, or it cannot be loaded.
    """
    return _designed(tuple(controller_class(controller).PARAMETERS))


NODE_PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    VEHICLE.name: (*VEHICLE.parameters, *PACE_PARAMETERS),
    NOTCH_FILTER.name: NOTCH_FILTER.parameters,
    NOMINAL_TRAJECTORY.name: _designed(NOMINAL_TRAJECTORY.parameters),
    TUBE_MPC.name: (*own_parameters(TUBE_MPC.name), *CERTIFICATE_PARAMETERS),
    ROBUST_MPC.name: own_parameters(ROBUST_MPC.name),
    FAULT_INJECTOR.name: FAULT_INJECTOR.parameters,
    RECORDER.name: RECORDER_PARAMETERS,
    LIVE.name: LIVE_PARAMETERS,
}
"""Parameter tables by node, without those of custom controllers. Every node also declares
:data:`hsv.bags.infrastructure_parameters.LOCKSTEP_PARAMETERS`."""

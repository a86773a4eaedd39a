"""Every parameter of every node: those of its component, and those of its part in the graph."""

from __future__ import annotations

from hsv.control.design_file import DESIGN_PARAMETERS
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS
from hsv.control.notch_filter import NOTCH_PARAMETERS
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS
from hsv.control.tube_law import TUBE_PARAMETERS
from hsv.design.certificate import CERTIFICATE_PARAMETERS
from hsv.faults.actuator import FAULT_PARAMETERS
from hsv.graph.part_parameters import PACE_PARAMETERS, RECORDER_PARAMETERS
from hsv.parameters import Parameter
from hsv.vehicle.plant import PLANT_PARAMETERS

NODE_PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    "plant": (*PLANT_PARAMETERS, *PACE_PARAMETERS),
    "notch_filter": NOTCH_PARAMETERS,
    "nominal_trajectory": (*NOMINAL_PARAMETERS, *DESIGN_PARAMETERS),
    "tube_mpc": (
        *TUBE_PARAMETERS,
        *CERTIFICATE_PARAMETERS,
        *(p for p in DESIGN_PARAMETERS if p.name not in {own.name for own in TUBE_PARAMETERS}),
    ),
    "robust_mpc": (*ROBUST_MPC_PARAMETERS, *DESIGN_PARAMETERS),
    "fault_injector": FAULT_PARAMETERS,
    "recorder": RECORDER_PARAMETERS,
}
"""By node; those of every node, :data:`hsv.graph.part_parameters.LOCKSTEP_PARAMETERS`, come to each."""

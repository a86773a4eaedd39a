"""Every parameter of every node: those of its component, and those of its part in the graph."""

from __future__ import annotations

from hsv.control.control_law import CONTROLLER_PARAMETERS
from hsv.control.design_file import DESIGN_PARAMETERS
from hsv.control.integral_action import INTEGRAL_PARAMETERS
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS
from hsv.control.notch_filter import NOTCH_PARAMETERS
from hsv.control.robust_mpc import ROBUST_MPC_PARAMETERS
from hsv.control.tube_law import TUBE_PARAMETERS
from hsv.design.certificate import CERTIFICATE_PARAMETERS
from hsv.faults.actuator import FAULT_PARAMETERS
from hsv.parameters import Parameter
from hsv.vehicle.plant import PLANT_PARAMETERS

LOCKSTEP_PARAMETERS = (
    Parameter("recorder", True, "whether a recorder belongs to the graph"),
    *CONTROLLER_PARAMETERS,
)
"""Of every node."""

PACE_PARAMETERS = (
    Parameter("real_time_factor", 0.0, "simulated over wall time; 0: as fast as possible", "", 0.0, 1e3),
    Parameter("start_timeout", 30.0, "wall time to wait for all nodes of the graph; 0: for ever", "s", 0.0, 1e6),
    Parameter("step_timeout", 10.0, "wall time to wait for a peer within a step", "s", 0.1, 1e6),
    Parameter("progress", False, "print the step to standard output, for a progress bar"),
)
"""Of the plant, which owns time."""

RECORDER_PARAMETERS = (
    Parameter("bag.directory", "", "bag to write, a new directory; empty: bags/run_<UTC>"),
    Parameter("bag.attachments", [""], "files to attach"),
    Parameter("bag.custom_data", [""], "key=value pairs for the bag's metadata"),
)

STAND_IN_PARAMETERS = (
    Parameter("stand_in.bag", "", "bag to feed the node from"),
    Parameter("stand_in.node", "", "node under test"),
    Parameter("stand_in.directory", "", "bag to write with its answers, a new directory"),
    Parameter("stand_in.timeout", 30.0, "wall time to wait for an answer", "s", 0.1, 1e6),
)
"""Of the stand-in for all other nodes, in a replay over DDS."""

NODE_PARAMETERS: dict[str, tuple[Parameter, ...]] = {
    "plant": (*PLANT_PARAMETERS, *PACE_PARAMETERS),
    "notch_filter": NOTCH_PARAMETERS,
    "nominal_trajectory": (*NOMINAL_PARAMETERS, *DESIGN_PARAMETERS),
    "tube_mpc": (
        *INTEGRAL_PARAMETERS,
        *TUBE_PARAMETERS,
        *CERTIFICATE_PARAMETERS,
        *(p for p in DESIGN_PARAMETERS if p.name not in {own.name for own in TUBE_PARAMETERS}),
    ),
    "robust_mpc": (*ROBUST_MPC_PARAMETERS, *DESIGN_PARAMETERS),
    "fault_injector": FAULT_PARAMETERS,
    "recorder": RECORDER_PARAMETERS,
}
"""By node; :data:`LOCKSTEP_PARAMETERS` come to each."""

"""All nodes of the graph, except an external controller, in one process with one executor.

Messages and bag are identical to those of separate processes; the flight takes less time.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from hsv.bags.description import controller_node
from hsv_bringup.flow_executor import FlowExecutor
from hsv_bringup.recorder import RecorderNode
from hsv_ctrl.blocks import ControllerNode, NotchFilterNode
from hsv_ctrl.nominal_trajectory import NominalTrajectoryNode
from hsv_ctrl.tube_mpc import RobustMpcNode, TubeMpcNode
from hsv_node.main import run_node
from hsv_node.process import ProcessNode
from hsv_plant.fault_injector import FaultInjectorNode
from hsv_plant.plant import PlantNode

CONTROLLER_NODES = {"tube_mpc": TubeMpcNode, "robust_mpc": RobustMpcNode}


def nodes() -> Iterator[ProcessNode]:
    """Yield the nodes of the graph, except an external controller, in the order of the data flow.

    The parameters of the plant determine the controller and whether there is a recorder.
    """
    plant = PlantNode()
    yield plant
    yield NotchFilterNode()
    yield NominalTrajectoryNode()
    if not controller_node(plant.controller).foreign:
        yield CONTROLLER_NODES.get(plant.controller, ControllerNode)()
    yield FaultInjectorNode()
    if plant.recorded:
        yield RecorderNode()


main = partial(run_node, nodes, "composed", executor_class=FlowExecutor, several=True)

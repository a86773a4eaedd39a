"""The node of custom controllers, registered or named by their class."""

from __future__ import annotations

from functools import partial

from hsv.bags.description import CONTROLLER, CONTROLLERS
from hsv.base.errors import ParameterError
from hsv.control.controllers import NODE, build_controller, controller_class
from hsv.flight.blocks import Signals
from hsv.graph.node_parameters import NODE_PARAMETERS
from hsv_ctrl.design import declare_design
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import given


class ControllerNode(BlockNode):
    """A node that steps the controller named by the parameter ``controller``: a registered one, or a class.

    Raises:
        ParameterError: It names none, or one with a node of its own; or a parameter is wrong, named.
    """

    def __init__(self) -> None:
        super().__init__(CONTROLLER, "controller")
        name = self.controller
        if name in CONTROLLERS or name.startswith(NODE):
            node = f"node {name}" if name in CONTROLLERS else "node that it names"
            raise ParameterError(
                f"parameter controller = {name!r}: expected one that is not a separate node, the {node} flies it"
            )
        # It may look at whatever else is known of the flight: as far as this node is told, it has it, too.
        flight = {p.name: p for table in NODE_PARAMETERS.values() for p in table if given(self, p.name)}
        own = {p.name: p for p in controller_class(name).PARAMETERS}
        values, design = declare_design(self, tuple((flight | own).values()))
        self.component = build_controller(values | {"controller": name}, design)

    def stepped(self, signals: Signals) -> None:
        """Report whether its command is limited."""
        if self.diagnosis_due(signals):
            self.diagnose(signals, saturated=bool(signals.saturated.any()))


main = partial(run_node, ControllerNode, CONTROLLER.name)

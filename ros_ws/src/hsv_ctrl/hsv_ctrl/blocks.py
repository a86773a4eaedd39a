"""Node of the notch filter, and node of every controller that has no node class of its own, such as a custom one."""

from __future__ import annotations

from functools import partial

from hsv.bags.description import CONTROLLER, CONTROLLERS, NOTCH_FILTER
from hsv.base.errors import ParameterError
from hsv.control.controller import NODE, ExternalController
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.control.notch_filter import NOTCH_PARAMETERS, NotchFilter
from hsv.flight.blocks import Signals
from hsv.plugins.controllers import build_controller, controller_class
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import declare, declare_design, declare_vehicle, given


class NotchFilterNode(BlockNode):
    """A node that publishes the filtered state for each measurement."""

    def __init__(self) -> None:
        super().__init__(NOTCH_FILTER, "filter")
        if self.estimator:
            declare_vehicle(self)
        table = NotchFilter.PARAMETERS if self.estimator else NOTCH_PARAMETERS
        self.component = NotchFilter.from_parameters(declare(self, (*table, ESTIMATOR_ENABLED)))


class ControllerNode(BlockNode):
    """A node that steps the controller that the parameter ``controller`` names, such as a custom class.

    Raises:
        ParameterError: ``controller`` is unknown or has a node of its own, or another parameter is wrong.
    """

    def __init__(self) -> None:
        from hsv.graph.node_parameters import NODE_PARAMETERS  # imports the components of all nodes

        super().__init__(CONTROLLER, "controller")
        name = self.controller
        if name in CONTROLLERS or name.startswith(NODE):
            node = f"node {name}" if name in CONTROLLERS else "node that it names"
            raise ParameterError(
                f"parameter controller = {name!r}: expected one that is not a separate node, the {node} flies it"
            )
        # A custom controller may use every parameter of the flight that this node is given.
        flight = {p.name: p for table in NODE_PARAMETERS.values() for p in table if given(self, p.name)}
        own = {p.name: p for p in controller_class(name).PARAMETERS}
        values, design = declare_design(self, tuple((flight | own).values()))
        self.component = build_controller(values | {"controller": name}, design)

    def stepped(self, signals: Signals) -> None:
        """Publish the diagnostics, with whether the command was limited; warn of a first command in degrees."""
        custom = isinstance(self.component, ExternalController) and signals.step == 0
        if custom and (doubt := self.component.doubt(signals.diagnostics.u_unsaturated)):
            self.get_logger().warning(doubt)
        self.diagnose(signals, saturated=bool(signals.saturated.any()))


notch_filter = partial(run_node, NotchFilterNode, NOTCH_FILTER.name)
controller = partial(run_node, ControllerNode, CONTROLLER.name)

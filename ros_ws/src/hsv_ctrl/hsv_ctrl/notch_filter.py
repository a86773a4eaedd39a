"""The notch filter node: filters the pitch rate of every measured or estimated state."""

from __future__ import annotations

from functools import partial

from hsv.bags.description import NOTCH_FILTER
from hsv.control.estimator import ESTIMATOR_ENABLED
from hsv.control.notch_filter import NOTCH_PARAMETERS, NotchFilter
from hsv.flight.blocks import Signals
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import declare, declare_vehicle


class NotchFilterNode(BlockNode):
    """A node that publishes the filtered state for each measurement."""

    def __init__(self) -> None:
        super().__init__(NOTCH_FILTER, "filter")
        if self.estimator:
            declare_vehicle(self)
        # Of what only an estimator needs, a node without one has none.
        table = NotchFilter.PARAMETERS if self.estimator else NOTCH_PARAMETERS
        self.component = NotchFilter.from_parameters(declare(self, (*table, ESTIMATOR_ENABLED)))

    def stepped(self, signals: Signals) -> None:
        """Publish the diagnostics."""
        if self.diagnosis_due(signals):
            self.diagnose(signals)


main = partial(run_node, NotchFilterNode, "notch_filter")

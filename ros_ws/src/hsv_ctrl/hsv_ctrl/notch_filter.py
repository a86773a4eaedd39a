"""The notch filter node: filters the pitch rate of every state."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import FilteredState, Run, VehicleState

from hsv.control.notch_filter import NOTCH_PARAMETERS, NotchFilter
from hsv.graph.description import FILTERED_STATE, NOTCH_FILTER, STATE
from hsv.graph.exchange import filter_state
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node
from hsv_node.parameters import declare


class NotchFilterNode(PeerNode):
    """Turns the state into the filtered state."""

    def __init__(self) -> None:
        super().__init__(NOTCH_FILTER, "filter")
        self.filter = NotchFilter.from_parameters(declare(self, NOTCH_PARAMETERS))
        self._message = FilteredState()
        self._filtered = self.create_step_publisher(FILTERED_STATE)
        self.create_step_subscription(STATE, self._on_state)

    def start_run(self, run: Run) -> None:
        """Start from rest."""
        self.filter.reset()

    def _on_state(self, state: VehicleState) -> None:
        filter_state(self.filter, state, self._message)
        self._filtered.publish(self._message)
        self.diagnose(state.header.stamp, step=state.step)


def main(args: Sequence[str] | None = None) -> int:
    """Run the notch filter node."""
    return run_node(NotchFilterNode, "notch_filter", args)

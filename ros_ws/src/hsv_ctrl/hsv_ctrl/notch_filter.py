"""The notch filter node: filters the pitch rate of every state."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import FilteredState, Run, VehicleState

from hsv.control.notch_filter import NOTCH_PARAMETERS, NotchFilter
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node
from hsv_node.parameters import declare


class NotchFilterNode(PeerNode):
    """Turns /hsv/state into /hsv/filtered_state."""

    def __init__(self) -> None:
        super().__init__("notch_filter")
        self.filter = NotchFilter.from_parameters(declare(self, NOTCH_PARAMETERS))
        self._message = FilteredState()
        self._filtered = self.talk("/hsv/filtered_state")
        self.listen("/hsv/state", self._on_state)

    def start_run(self, run: Run) -> None:
        """Start from rest."""
        self.filter.reset()

    def _on_state(self, state: VehicleState) -> None:
        result = self.filter.step(state.pitch_rate)
        message = self._message
        message.header, message.step, message.status = state.header, state.step, state.status
        copy = message.state
        copy.altitude, copy.velocity = state.altitude, state.velocity
        copy.angle_of_attack, copy.pitch_angle, copy.pitch_rate = (
            state.angle_of_attack,
            state.pitch_angle,
            state.pitch_rate,
        )
        copy.elastic_coordinate, copy.elastic_rate = state.elastic_coordinate, state.elastic_rate
        message.filtered_pitch_rate = result.filtered_pitch_rate
        message.filter_state = result.filter_state
        self._filtered.publish(message)
        self.diagnose(state.header.stamp, step=state.step)


def main(args: Sequence[str] | None = None) -> int:
    """Run the notch filter node."""
    return run_node(NotchFilterNode, "notch_filter", args)

"""The nominal trajectory node: reference equilibrium and nominal state of every step."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import NominalState, Run, VehicleState

from hsv.control.nominal_law import NominalStatus
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS, NominalTrajectory
from hsv_ctrl.design import declare_design
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node
from hsv_node.messages import fill_input, fill_state, state_vector


class NominalTrajectoryNode(PeerNode):
    """Turns /hsv/state into /hsv/nominal."""

    def __init__(self) -> None:
        super().__init__("nominal_trajectory")
        self.trajectory = NominalTrajectory.from_parameters(declare_design(self, NOMINAL_PARAMETERS))
        self._message = NominalState()
        self._nominal = self.talk("/hsv/nominal")
        self.listen("/hsv/state", self._on_state)

    def start_run(self, run: Run) -> None:
        """Start a new nominal trajectory."""
        self.trajectory.reset()

    def _on_state(self, state: VehicleState) -> None:
        result = self.trajectory.step(state_vector(state))
        message = self._message
        message.header, message.step = state.header, state.step
        fill_state(message.reference, result.reference)
        fill_input(message.reference_input, result.reference_input)
        fill_state(message.deviation, result.deviation)
        fill_input(message.input, result.input)
        message.gain_index, message.status = result.gain_index, int(result.status)
        self._nominal.publish(message)
        self.diagnose(
            state.header.stamp,
            "running" if result.status is NominalStatus.OK else str(result.status.name),
            step=state.step,
            gain_index=result.gain_index,
        )


def main(args: Sequence[str] | None = None) -> int:
    """Run the nominal trajectory node."""
    return run_node(NominalTrajectoryNode, "nominal_trajectory", args)

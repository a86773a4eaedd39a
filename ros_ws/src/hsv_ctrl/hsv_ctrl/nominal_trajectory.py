"""The nominal trajectory node: reference equilibrium and nominal state of every step."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import NominalState, Run, VehicleState

from hsv.control.nominal_law import NominalStatus
from hsv.control.nominal_trajectory import NOMINAL_PARAMETERS, NominalTrajectory
from hsv.graph.description import NOMINAL, NOMINAL_TRAJECTORY, STATE
from hsv.graph.exchange import plan_nominal
from hsv_ctrl.design import declare_design
from hsv_ctrl.step_times import StepTimes
from hsv_node.lockstep import PeerNode
from hsv_node.main import run_node


class NominalTrajectoryNode(PeerNode):
    """Turns the state into reference and nominal state."""

    def __init__(self) -> None:
        super().__init__(NOMINAL_TRAJECTORY, "trajectory")
        self.trajectory = NominalTrajectory.from_parameters(*declare_design(self, NOMINAL_PARAMETERS))
        self._times, self._failed = StepTimes(), False
        self._message = NominalState()
        self._nominal = self.create_step_publisher(NOMINAL)
        self.create_step_subscription(STATE, self._on_state)

    def start_run(self, run: Run) -> None:
        """Start a new nominal trajectory."""
        self.trajectory.reset()
        self._times, self._failed = StepTimes(), False

    def _on_state(self, state: VehicleState) -> None:
        with self._times:
            result = plan_nominal(self.trajectory, state, self._message)
        self._nominal.publish(self._message)
        failed = NominalStatus.SOLVER_FAILED in result.status
        fails, self._failed = failed and not self._failed, failed
        self.diagnose(
            state.header.stamp,
            "running" if result.status is NominalStatus.OK else str(result.status.name),
            warning=fails,
            step=state.step,
            gain_index=result.gain_index,
            step_time_p99_ms=self._times,
        )


def main(args: Sequence[str] | None = None) -> int:
    """Run the nominal trajectory node."""
    return run_node(NominalTrajectoryNode, "nominal_trajectory", args)

"""The nominal trajectory node: reference equilibrium and nominal state of every step."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import Run

from hsv.control.nominal_law import NominalStatus
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.graph.description import NOMINAL_TRAJECTORY
from hsv.simulation.blocks import Signals
from hsv_ctrl.design import declare_design
from hsv_ctrl.step_times import StepTimes
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.parameters import declare_vehicle


class NominalTrajectoryNode(BlockNode):
    """Turns the measurement into reference and nominal state."""

    def __init__(self) -> None:
        super().__init__(NOMINAL_TRAJECTORY, "trajectory")
        declare_vehicle(self)
        self.component = NominalTrajectory.from_parameters(*declare_design(self, NominalTrajectory.PARAMETERS))
        self._times, self._failed = StepTimes(), False

    def start_run(self, run: Run) -> None:
        """Start a new nominal trajectory."""
        super().start_run(run)
        self._times, self._failed = StepTimes(), False

    def advance(self, signals: Signals) -> None:
        """Step the trajectory and note how long it takes: some laws solve a problem in flight."""
        with self._times:
            super().advance(signals)

    def stepped(self, signals: Signals) -> None:
        """Tell how the law fares; a solver that begins to fail is a warning."""
        status = NominalStatus(signals.nominal_status)
        failed = NominalStatus.SOLVER_FAILED in status
        fails, self._failed = failed and not self._failed, failed
        if fails or self.diagnosis_due(signals.header.stamp):
            self.diagnose(
                signals.header.stamp,
                "running" if status is NominalStatus.OK else str(status.name),
                warning=fails,
                step=signals.step,
                gain_index=signals.gain_index,
                step_time_p99_ms=self._times,
            )


def main(args: Sequence[str] | None = None) -> int:
    """Run the nominal trajectory node."""
    return run_node(NominalTrajectoryNode, "nominal_trajectory", args)

"""The nominal trajectory node: reference equilibrium and nominal state of every step."""

from __future__ import annotations

from collections.abc import Sequence

from hsv_msgs.msg import Reference, Run
from hsv_msgs.srv import SetCommand

from hsv.bags.description import NOMINAL_TRAJECTORY, REFERENCE, SET_COMMAND
from hsv.bags.messages import FRAME, stamp_of
from hsv.base.errors import HsvError
from hsv.control.nominal_law import NominalStatus
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.flight.blocks import Signals
from hsv_ctrl.design import declare_design
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED
from hsv_node.parameters import declare_vehicle

_SOLVER_FAILED = int(NominalStatus.SOLVER_FAILED)


class NominalTrajectoryNode(BlockNode):
    """A node that publishes reference and nominal state for each measurement, and accepts commands in flight."""

    def __init__(self) -> None:
        super().__init__(NOMINAL_TRAJECTORY, "trajectory")
        declare_vehicle(self)
        self._values, self._design = declare_design(self, NominalTrajectory.PARAMETERS)
        self._period = self._values["period"]
        self.component = self._trajectory = NominalTrajectory.from_parameters(self._values, self._design)
        self._failed = False
        self._references = self.create_publisher(Reference, REFERENCE, LATCHED)
        self.create_service(SetCommand, SET_COMMAND, self._command)

    def start_run(self, run: Run) -> None:
        """Start a new nominal trajectory."""
        super().start_run(run)
        self._failed = False
        self._publish_reference(0)

    def stepped(self, signals: Signals) -> None:
        """Report the status of the law; warn when a solver begins to fail."""
        failed = bool(int(signals.nominal_status) & _SOLVER_FAILED)
        fails, self._failed = failed and not self._failed, failed
        if fails or self.diagnosis_due(signals):
            status = NominalStatus(signals.nominal_status)
            self.diagnose(
                signals,
                "running" if status is NominalStatus.OK else str(status.name),
                warning=fails,
                gain_index=signals.gain_index,
            )

    def _command(self, request: SetCommand.Request, response: SetCommand.Response) -> SetCommand.Response:
        # Not at the top: only who is commanded in flight needs it, and every start would load it.
        from hsv.control.governor import CommandGovernor

        try:
            governor = CommandGovernor.from_parameters(self._values, self._design, self._trajectory)
            response.step, response.end = governor.command(
                request.altitude, request.velocity, request.duration, request.blend
            )
        except HsvError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        response.message = (
            f"to {request.altitude:.6g} m and {request.velocity:.6g} m/s from step {response.step} on, at rest at "
            f"{response.end:.2f} s"
        )
        self.get_logger().info(response.message)
        self._publish_reference(response.step)
        return response

    def _publish_reference(self, step: int) -> None:
        message = Reference(step=step, **self._trajectory.reference.columns)
        message.header.frame_id = FRAME
        message.header.stamp.sec, message.header.stamp.nanosec = stamp_of(step, self._period)
        self._references.publish(message)


def main(args: Sequence[str] | None = None) -> int:
    """Run the nominal trajectory node."""
    return run_node(NominalTrajectoryNode, "nominal_trajectory", args)

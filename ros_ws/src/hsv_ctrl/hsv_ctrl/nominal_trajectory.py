"""The nominal trajectory node: publishes the reference and the nominal state of every step."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from hsv_msgs.msg import Reference, Run
from hsv_msgs.srv import SetCommand

from hsv.bags.description import NOMINAL_TRAJECTORY, REFERENCE, SET_COMMAND
from hsv.bags.messages import FRAME, stamp_of
from hsv.base.errors import GovernorError, HsvError
from hsv.control.governor import command_in_flight
from hsv.control.nominal_law import NominalStatus
from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.reference_trajectory import ReferenceTrajectory
from hsv.flight.blocks import Signals
from hsv_node.block import BlockNode
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED
from hsv_node.parameters import declare_design, declare_vehicle

_SOLVER_FAILED = int(NominalStatus.SOLVER_FAILED)

_PLAN_LOOK = 0.02
"""Time (s) between checks whether a plan is complete."""


class NominalTrajectoryNode(BlockNode):
    """A node that publishes reference and nominal state for each measurement, and accepts commands in flight.

    A command is planned in a thread. The node announces the first step that the plan changes, and the flight waits at
    that step until the plan is complete. The flight therefore does not depend on the computing time.
    """

    def __init__(self) -> None:
        super().__init__(NOMINAL_TRAJECTORY, "trajectory")
        declare_vehicle(self)
        self._values, self._design = declare_design(self, NominalTrajectory.PARAMETERS)
        self._period = self._values["period"]
        self.component = self._trajectory = NominalTrajectory.from_parameters(self._values, self._design)
        self._failed = False
        self._planner = ThreadPoolExecutor(1)
        self._plan: Future[ReferenceTrajectory] | None = None
        """The plan that is being computed, or None."""
        self._first, self._words = 0, ""
        """The first step that the plan changes, and the command in words."""
        self._references = self.create_publisher(Reference, REFERENCE, LATCHED)
        self.serve(SetCommand, SET_COMMAND, self._command)

    def start_run(self, run: Run) -> None:
        """Restart the nominal trajectory for a new run."""
        super().start_run(run)
        self._failed = False
        self._plan = None
        self._publish_reference(0)

    def stepped(self, signals: Signals) -> None:
        """Publish the status of the nominal law as diagnostics; warn when its solver begins to fail."""
        failed = bool(int(signals.nominal_status) & _SOLVER_FAILED)
        begins, self._failed = failed and not self._failed, failed
        if self.diagnosed(signals) and not begins:
            return
        status = NominalStatus(signals.nominal_status)
        summary = "running" if status is NominalStatus.OK else str(status.name)
        self.diagnose(signals, summary, warning=begins, gain_index=signals.gain_index)

    def holds(self, step: int) -> bool:
        """Return whether ``step`` needs a plan that is still being computed."""
        return self._plan is not None and step >= self._first

    def poll(self) -> None:
        """Once a plan is computed, switch to it or reject its command; then answer the step that waited for it."""
        super().poll()
        if self._plan is not None and self._plan.done():
            plan, self._plan = self._plan, None
            self._take(plan)
            self.answer(self._trajectory.next_step)

    def wait_timeout(self) -> float:
        """Return the time (s) to the next poll, which is shorter while a plan is being computed."""
        return _PLAN_LOOK if self._plan is not None else super().wait_timeout()

    def _command(self, request: SetCommand.Request) -> tuple[int, str]:
        if self._plan is not None:
            raise GovernorError("the command before is still being planned: expected one at a time")
        flown, target = (self._values, self._design, self._trajectory), (request.altitude, request.velocity)
        self._first, plan = command_in_flight(*flown, target, request.duration, request.blend)
        self._plan = self._planner.submit(plan)
        self._words = f"to {request.altitude:.6g} m and {request.velocity:.6g} m/s from step {self._first} on"
        self._publish_reference(self._first, Reference.PLANNING)
        return self._first, self._words

    def _take(self, plan: Future[ReferenceTrajectory]) -> None:
        try:
            reference = plan.result()
        except HsvError as error:
            self.get_logger().warning(f"rejected {self._words}: {error}")
            self._publish_reference(self._first, Reference.REJECTED)
            return
        self._trajectory.change_reference(reference)
        self.get_logger().info(f"{self._words}, at rest at {reference.end:.2f} s")
        self._publish_reference(self._first)

    def _publish_reference(self, step: int, status: int = Reference.FLOWN) -> None:
        message = Reference(step=step, status=status, **self._trajectory.reference.columns)
        message.header.frame_id = FRAME
        message.header.stamp.sec, message.header.stamp.nanosec = stamp_of(step, self._period)
        self._references.publish(message)


main = partial(run_node, NominalTrajectoryNode, "nominal_trajectory")

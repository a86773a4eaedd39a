"""Base of the controller nodes: joins filtered and nominal state of a step to the command."""

from __future__ import annotations

from hsv_msgs.msg import ControlInput, FilteredState, NominalState, Run, TubeStatus

from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeLaw, TubeStatusCode
from hsv.errors import ParameterError
from hsv.graph.description import COMMAND, FILTERED_STATE, NOMINAL, TUBE_STATUS, NodeDescription
from hsv.graph.exchange import control, fill_tube_status
from hsv_node.lockstep import PeerNode
from hsv_node.parameters import given


class ControllerNode(PeerNode):
    """Turns filtered and nominal state into the command and the status of the tube."""

    law: TubeLaw | RobustMpc
    """Set by the node."""
    follows_nominal = True
    """Whether the nominal input is a part of the command."""

    def __init__(self, role: NodeDescription) -> None:
        super().__init__(role, "tube")
        if given(self, "controller") and self.controller != role.name:
            raise ParameterError(
                f"parameter controller = {self.controller!r}: expected {role.name}, which this node is"
            )
        self._state: FilteredState | None = None
        self._nominal: NominalState | None = None
        self._outside = False
        self._command_message, self._status_message = ControlInput(), TubeStatus()
        self._command = self.create_step_publisher(COMMAND)
        self._status = self.create_step_publisher(TUBE_STATUS)
        self.create_step_subscription(FILTERED_STATE, self._on_state)
        self.create_step_subscription(NOMINAL, self._on_nominal)

    def start_run(self, run: Run) -> None:
        """Forget the last messages of the run before."""
        self._state = self._nominal = None
        self._outside = False
        self.law.reset()

    def _on_state(self, state: FilteredState) -> None:
        self._state = state
        self._join()

    def _on_nominal(self, nominal: NominalState) -> None:
        self._nominal = nominal
        self._join()

    def _join(self) -> None:
        state, nominal = self._state, self._nominal
        if state is None or nominal is None or state.step != nominal.step:
            return
        result = control(self.law, state, nominal, self._command_message)
        # The command first: the other nodes work on it while the rest is published.
        self._command.publish(self._command_message)
        fill_tube_status(result, state, nominal, self.follows_nominal, self._status_message)
        self._status.publish(self._status_message)
        outside = result.status is TubeStatusCode.OUTSIDE
        left, self._outside = outside and not self._outside, outside
        stamp = state.header.stamp
        if left:
            time = stamp.sec + 1e-9 * stamp.nanosec
            self.get_logger().warning(f"left the tube at {time:.2f} s: {result.component}, level {result.level:.3f}")
        self.diagnose(
            stamp,
            result.status.name,
            warning=left,
            step=state.step,
            saturated=bool(result.saturated.any()),
            level=result.level,
            component=result.component,
        )

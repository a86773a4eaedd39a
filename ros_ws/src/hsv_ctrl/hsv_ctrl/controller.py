"""Base of the controller nodes: joins filtered and nominal state of a step to the command."""

from __future__ import annotations

import numpy as np
from hsv_msgs.msg import ControlInput, FilteredState, NominalState, Run, TubeStatus

from hsv.control.control_law import ControlLaw
from hsv.control.tube_law import TubeStatusCode
from hsv_node.lockstep import PeerNode
from hsv_node.messages import fill_input, input_vector, state_vector


class ControllerNode(PeerNode):
    """Turns /hsv/filtered_state and /hsv/nominal into /hsv/command and /hsv/tube_status."""

    law: ControlLaw
    """Set by the node."""
    follows_nominal = True
    """Whether the nominal input is a part of the command."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self._state: FilteredState | None = None
        self._nominal: NominalState | None = None
        self._outside = False
        self._command_message, self._status_message = ControlInput(), TubeStatus()
        self._command = self.talk("/hsv/command")
        self._status = self.talk("/hsv/tube_status")
        self.listen("/hsv/filtered_state", self._on_state)
        self.listen("/hsv/nominal", self._on_nominal)

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
        u_n, u_r = input_vector(nominal.input), input_vector(nominal.reference_input)
        result = self.law.step(
            state_vector(state.state),
            state.filtered_pitch_rate,
            np.asarray(state.filter_state),
            state_vector(nominal.reference),
            u_r,
            state_vector(nominal.deviation),
            u_n,
        )
        command = self._command_message
        command.header, command.step = state.header, state.step
        fill_input(command, result.input)
        self._command.publish(command)

        status = self._status_message
        status.header, status.step = state.header, state.step
        status.error = result.error
        status.tube_centre, status.tube_half_width = result.tube_centre, result.tube_half_width
        status.level, status.inside = result.level, result.inside
        if self.follows_nominal:
            status.u_nominal = nominal.input
        status.u_reference = nominal.reference_input
        fill_input(status.u_feedback, result.u_feedback)
        fill_input(status.u_unsaturated, result.u_unsaturated)
        status.saturated = result.saturated.tolist()
        status.tau, status.status = result.tau, int(result.status)
        self._status.publish(status)
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

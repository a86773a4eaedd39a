"""Common code of the nodes that publish the status of the tube."""

from __future__ import annotations

from hsv_msgs.msg import Run

from hsv.bags.description import NodeDescription
from hsv.base.errors import ParameterError
from hsv.control.effectiveness import EffectivenessMode
from hsv.control.tube_law import TubeResult, TubeStatusCode
from hsv.flight.blocks import Signals
from hsv_ctrl.step_times import StepTimes
from hsv_node.block import BlockNode
from hsv_node.parameters import given


class TubeNode(BlockNode):
    """A controller node of one name that says of every step how the error lies in the tube.

    Raises:
        ParameterError: The graph's parameter ``controller`` names another controller.
    """

    def __init__(self, role: NodeDescription) -> None:
        super().__init__(role, "tube")
        if given(self, "controller") and self.controller != role.name:
            raise ParameterError(
                f"parameter controller = {self.controller!r}: expected {role.name}, which this node is"
            )
        self._begin()

    def start_run(self, run: Run) -> None:
        """Begin inside the tube."""
        super().start_run(run)
        self._begin()

    def _begin(self) -> None:
        self._times = StepTimes()
        self._outside = False
        self._mode = EffectivenessMode.HEALTHY

    def advance(self, signals: Signals) -> None:
        """Step the law and note how long it takes."""
        with self._times:
            super().advance(signals)

    def stepped(self, signals: Signals) -> None:
        """Report the tube status; warn when the error leaves the tube."""
        result = signals.diagnostics
        assert isinstance(result, TubeResult)
        outside = result.status is TubeStatusCode.OUTSIDE
        left, self._outside = outside and not self._outside, outside
        if left:
            time = signals.stamp[0] + 1e-9 * signals.stamp[1]
            self.get_logger().warning(f"left the tube at {time:.2f} s: {result.component}, level {result.level:.3f}")
        found, changed, known = result.effectiveness, False, {}
        if found:
            changed, self._mode = found.mode is not self._mode, found.mode
            known = {
                "effectiveness": found.estimate,
                "effectiveness_low": found.low,
                "effectiveness_high": found.high,
                "elevator": found.mode.name,
            }
        if found and changed:
            self.get_logger().warning(f"elevator {found}")
        if left or changed or self.diagnosis_due(signals):
            self.diagnose(
                signals,
                f"elevator {found}" if changed else result.status.name,
                warning=left or changed,
                saturated=bool(result.saturated.any()),
                level=result.level,
                component=result.component,
                step_time_p99_ms=self._times,
                **known,
            )

"""The plant node: defines simulated time, publishes the state of a step and integrates when the input has arrived."""

from __future__ import annotations

import math
import signal
import time
import uuid
from collections.abc import Sequence
from functools import partial

import rclpy
from hsv_msgs.msg import Ready, RecorderProgress, Reference, Run, VehicleState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import ListParameters
from rclpy.duration import Duration
from rclpy.parameter import Parameter as RosParameter

from hsv.bags.description import (
    ACTUATOR,
    EXIT_DIVERGED,
    EXIT_INTERRUPTED,
    FAULT_INJECTOR,
    LAST_STATE,
    PLANT,
    READY,
    RECORDER,
    RECORDER_PROGRESS,
    REFERENCE,
    RUN,
    STATE,
    NodeDescription,
    controller_node,
    peers,
)
from hsv.bags.infrastructure_parameters import PACE_PARAMETERS
from hsv.bags.messages import StepMessages, stamp_of
from hsv.base.errors import SignalError
from hsv.core.arithmetic import SEED_PARAMETER
from hsv.flight.blocks import VEHICLE, Signals
from hsv.graph.standstill import Standstill
from hsv.model.plant import FlightStatus, Plant
from hsv.model.signals import INPUT_NAMES
from hsv_node.lockstep import LINK_CHECK, LOG_INTERVAL, LockstepNode, run_in_words, short_id, step_in_words
from hsv_node.main import run_node
from hsv_node.middleware import LATCHED, STEP, ServiceCall
from hsv_node.parameters import declare, declare_vehicle
from hsv_plant.simulation_control import SimulationControl

MAX_AHEAD = 100
"""Maximum number of steps that the plant may be ahead of the recorder."""

_IN_FLIGHT = tuple(parameter.name for parameter in PACE_PARAMETERS if not parameter.read_only)


class PlantNode(LockstepNode):
    """A node that publishes measurement, state, forces and clock, and advances a step per actuator message."""

    def __init__(self) -> None:
        super().__init__(PLANT, "flight")
        declare_vehicle(self)
        self.values = declare(self, (*Plant.PARAMETERS, *PACE_PARAMETERS))
        self.plant = Plant.from_parameters(self.values)
        self._peers = [node for node in peers(PLANT, self.controller, self.recorded) if not node.foreign]
        self._ready: set[str] = set()
        # The measurement first: the other nodes process it while the rest is published.
        self._answers = [(StepMessages(topic).pack, self.create_step_publisher(topic)) for topic in PLANT.publishes]
        self._actuator_messages = StepMessages(ACTUATOR)
        self.create_step_subscription(ACTUATOR, self._on_actuator)
        self.create_subscription(Ready, READY, self._on_ready, LATCHED)
        self.create_subscription(RecorderProgress, RECORDER_PROGRESS, self._on_progress, STEP)
        self._references = self.create_subscription(Reference, REFERENCE, self._on_reference, LATCHED)
        self._planning = False
        """Whether nominal_trajectory is computing the plan of a command."""
        self._announcer = self.create_publisher(Run, RUN, LATCHED)
        self._last_state = self.create_publisher(VehicleState, LAST_STATE, LATCHED)
        self._broken_off = ""
        """Reason why the run was aborted; empty otherwise."""
        self._messages = 0
        """Number of messages received from the other nodes; if it does not increase, the plant ends the run."""
        self._begin()
        self.add_on_set_parameters_callback(self._on_change)
        self._control = SimulationControl(self)

    def _begin(self) -> None:
        """Announce a run, which starts when all nodes are ready for it."""
        self._run = Run(
            run_id=uuid.uuid4().hex,
            period=self.plant.period,
            last_step=self.plant.steps,
            seed=self.values[SEED_PARAMETER.name],
            interface_version=Run.INTERFACE_VERSION,
        )
        self._ready.clear()
        self._signals = Signals()
        self._advance()
        self._started = False
        self._published = False
        """Whether step 0 has been published; a flight that starts paused publishes it when it is resumed."""
        self._recorded_step = -1
        self._answered = False
        """Whether the input of the actuators for this step has arrived."""
        self._flown = False
        self._stepping_to = 0
        """Step at which a paused flight stops again after a request for steps."""
        self._resets = False
        """Whether the run is to be reset as soon as none of its messages is pending."""
        self._begun = time.monotonic()
        self._paced_from = self._begun, 0
        """Wall time (s) and step at the start of the current pace."""
        self._standstill = Standstill()
        self._announcer.publish(self._run)

    @property
    def step(self) -> int:
        """The current step."""
        return int(self._signals.step)

    @property
    def paused(self) -> bool:
        """Whether the flight is paused; False while requested steps are executed."""
        return bool(self.values["paused"]) and self.step >= self._stepping_to

    @property
    def run_id(self) -> str:
        """Identifier of the current run."""
        return str(self._run.run_id)

    @property
    def state(self) -> list[float]:
        """The current state, shape (9,), SI."""
        return [float(number) for number in self._signals.state]

    @property
    def stamp(self) -> tuple[int, int]:
        """Simulated time of the current step: seconds and nanoseconds."""
        return self._signals.stamp

    def fly_on(self, steps: int) -> None:
        """Execute ``steps`` steps of a paused flight."""
        self._paced_from = time.monotonic(), self.step
        self._stepping_to = self.step + steps
        self._continue()

    def reset(self) -> bool:
        """Restart the flight as soon as the current step is complete; return False if the flight is already over."""
        self._resets = self._signals.status is FlightStatus.RUNNING
        self._continue()
        return self._resets or self.step == 0

    def quit(self, reason: str) -> None:
        """Break the run off for ``reason``, with exit code 130."""
        self._broken_off = reason
        self.finish(EXIT_INTERRUPTED)

    def _on_ready(self, ready: Ready) -> None:
        if ready.run_id == self._run.run_id:
            self._ready.add(ready.node)

    def _on_reference(self, reference: Reference) -> None:
        self._planning = reference.status == Reference.PLANNING

    def _on_change(self, parameters: list[RosParameter]) -> SetParametersResult:
        """Change pace or pause; the change acts from the next step that is published."""
        step = self._signals.step
        for parameter in parameters:
            if parameter.name in _IN_FLIGHT:
                self.values[parameter.name] = parameter.value
                if parameter.name == "paused":
                    self._stepping_to = 0
                self._paced_from = time.monotonic(), step
                said = str(parameter.value).lower()  # as in files: true, not True
                self.log_change(f"{parameter.name} = {said} from step {step + 1 if self._published else step} on")
        return SetParametersResult(successful=True)

    def _on_progress(self, progress: RecorderProgress) -> None:
        self._recorded_step = progress.step
        self._messages += 1
        self._continue()

    def _on_actuator(self, message: bytes) -> None:
        signals = self._signals
        step = self._actuator_messages.step(message)
        if not self._published or step != signals.step:
            # A message from outside this graph.
            self.get_logger().error(
                f"{self.resolve_topic_name(ACTUATOR)} of step {step}: expected {signals.step}, ignored (published by "
                f"{', '.join(self.publishers_of(ACTUATOR)) or 'a node that is gone'})",
                throttle_duration_sec=LOG_INTERVAL,
            )
            return
        self._messages += 1
        if signals.status is FlightStatus.RUNNING:
            try:
                self._actuator_messages.unpack(message, signals)
            except SignalError as error:
                self._broken_off = self.refuse_message(ACTUATOR, error)
                return
            numbers = zip(INPUT_NAMES, signals.actuator.tolist(), strict=True)
            if wrong := ", ".join(f"{key} = {value}" for key, value in numbers if not math.isfinite(value)):
                name = self._controller_name
                self._broken_off = self.fail(f"{name}, step {signals.step}: {wrong}, expected a finite number")
                return
            self._answered = True
        else:
            self._flown = True
        self._continue()

    def _continue(self) -> None:
        """Reset, end or advance the run, as far as input, recorder, pause and pace permit."""
        if self._resets and (self._answered or not self._published):
            # Not earlier: the actuator message is the last message of a step that a node waits for.
            self.get_logger().info(f"run {short_id(self._run)} reset at {step_in_words(self.step, self.plant.period)}")
            self._begin()
            self._control.stepping.moved()
        elif not self._published:
            if self._started and not self.paused:
                self._publish()
        elif self._flown and (not self.recorded or self._recorded_step >= self._signals.step):
            self._land()
        elif self._answered and not self.paused and self._delay() <= 0.0 and self._room():
            self._answered = False
            self._advance()
            self._publish()

    def _advance(self) -> None:
        VEHICLE.step(self.plant, self._signals)
        self._signals.stamp = stamp_of(self.step, self._signals.period)

    def _room(self) -> bool:
        return not self.recorded or self._signals.step < self._recorded_step + MAX_AHEAD

    def _delay(self) -> float:
        """Return the wall time (s) until the next state is due; negative if it is late or if there is no pace."""
        factor, (begun, first) = self.values["real_time_factor"], self._paced_from
        due = begun + (self.step + 1 - first) * self.plant.period / factor if factor else 0.0
        return due - time.monotonic()

    def _publish(self) -> None:
        signals, self._published = self._signals, True
        for pack, publish in self._answers:
            publish(pack(signals))
        status = FlightStatus(signals.status)
        if self._stepping_to:
            self._control.stepping.moved()
        if self.values["progress"] and (signals.step % 50 == 0 or status is not FlightStatus.RUNNING):
            print(f"step {signals.step} of {self.plant.steps}", flush=True)
        self.diagnose(signals, status=status.name)

    def poll(self) -> None:
        """Start when all nodes are ready, keep the pace, and end the run if other nodes are silent for too long."""
        if not self._started:
            self._try_start()
        else:
            self._continue()
            # While the run is paused, a command is planned, or the pace delays the next step, no node can be late.
            planning = self._planning and self._references.get_publisher_count() > 0
            waits = self.paused or planning or (self._answered and self._delay() > 0.0)
            waited = self._standstill.look(time.monotonic() if waits else self._messages)
            if waited > self.values["step_timeout"]:
                self._give_up(waited)

    def wait_timeout(self) -> float:
        """Return the time (s) to the next poll, or to the next state in a paced flight."""
        if not self._started:
            return LINK_CHECK
        due = self._answered and self._room() and not self.paused
        return min(max(self._delay(), 0.0), 0.25) if due else 0.25

    def stopped(self, signal_number: int) -> int:
        """Return the exit code after a signal (0 after Ctrl-C), and keep the signal's name for :meth:`close` to log."""
        self._broken_off = signal.Signals(signal_number).name
        return super().stopped(signal_number)

    def close(self) -> None:
        """If the run has started, announce its end to the other nodes and, unless the flight diverged, log it."""
        self._control.stepping.close()
        if not self._started:
            return
        run, where = f"run {short_id(self._run)}", step_in_words(self.step, self.plant.period)
        if self._signals.status is FlightStatus.RUNNING:
            self.get_logger().info(f"{run} broken off at {where}: {self._broken_off or 'an error'}")
        elif self._signals.status is FlightStatus.FINISHED:
            self.get_logger().info(f"{run} finished at {where}")
        self._last_state.publish(StepMessages(STATE).pack(self._signals))
        # Wait at most 1 s; usually the other nodes receive it much sooner.
        self._last_state.wait_for_all_acked(Duration(seconds=1.0))

    def _try_start(self) -> None:
        unready = [peer.name for peer in self._peers if peer.name not in self._ready]
        missing = [f"{name} ({self.resolve_topic_name(READY)})" for name in unready] or self.missing_links()
        if not missing:
            self._started = True
            # Look it up now, because a controller that has ended cannot be found.
            self._controller_name = self.node_in_role(controller_node(self.controller)) or "the controller"
            self._paced_from = time.monotonic(), 0
            self._standstill = Standstill()
            self.get_logger().info(f"starts {run_in_words(self._run)}")
            self._continue()
            return
        self.log_waiting(missing, decides=True)
        limit = self.values["start_timeout"]
        if limit and time.monotonic() - self._begun > limit:
            self.fail(f"no start within {limit:g} s: still waiting for " + ", ".join(missing))

    def _give_up(self, waited: float) -> None:
        behind_recorder = self._flown or not self._room()
        source = RECORDER if behind_recorder else FAULT_INJECTOR
        topic = self.resolve_topic_name(RECORDER_PROGRESS if behind_recorder else ACTUATOR)
        here = {node.get_fully_qualified_name() for node in self.process_nodes}
        elsewhere = [peer for peer in self._peers if self.node_in_role(peer) not in here]
        silent, slowest = unresponsive(self, elsewhere)
        if not silent and not behind_recorder and controller_node(self.controller).foreign:
            silent = [self._controller_name]
        if silent:
            self._broken_off = f"no answer from {', '.join(silent)}"
        else:
            self._broken_off = "all nodes answer, " + (f"{slowest} last" if slowest else "one of them is stuck")
        self.fail(f"step {self.step}: no {topic} (from {source.name}) for {waited:.1f} s; {self._broken_off}")

    def _land(self) -> None:
        state, diverged = self._signals.state, self._signals.status is FlightStatus.DIVERGED
        if diverged:
            self.get_logger().error(
                f"flight diverged at t = {self.step * self.plant.period:.2f} s: "
                f"angle of attack {state[2]:.3g} rad, pitch angle {state[3]:.3g} rad"
            )
        self.finish(EXIT_DIVERGED if diverged else 0)


def unresponsive(node: LockstepNode, peers: Sequence[NodeDescription]) -> tuple[list[str], str | None]:
    """Return the names of the ``peers`` that do not answer, and the name of the last one that answers, or None.

    The function calls the parameter service of every peer; it ends when all have answered, or after 2 s in
    which no request is sent and no answer arrives.
    """
    # The helper ignores remappings given on the command line.
    helper = rclpy.create_node(f"{node.get_name()}_liveness", context=node.context, use_global_arguments=False)
    try:
        calls: dict[str, ServiceCall] = {}
        standstill, answered = Standstill(), list[str]()
        while len(answered) < len(peers):
            for peer in peers:
                if peer.name not in calls and (name := node.node_in_role(peer)):
                    service = f"{name}/list_parameters"
                    calls[peer.name] = ServiceCall(helper, ListParameters, service, ListParameters.Request())
            rclpy.spin_once(helper, timeout_sec=0.05)
            answered += [name for name, call in calls.items() if call.response() and name not in answered]
            if standstill.look((sum(call.sent for call in calls.values()), len(answered))) >= 2.0:
                break
        return [peer.name for peer in peers if peer.name not in answered], answered[-1] if answered else None
    finally:
        helper.destroy_node()


main = partial(run_node, PlantNode, "plant")

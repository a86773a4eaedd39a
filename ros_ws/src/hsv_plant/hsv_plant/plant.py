"""The plant node: owns simulated time, publishes the state of a step and integrates when its input has come."""

from __future__ import annotations

import signal
import time
import uuid
from collections.abc import Sequence

import numpy as np
from hsv_msgs.msg import ControlInput, Ready, RecorderProgress, Run, VehicleForces, VehicleState
from rclpy.duration import Duration
from rosgraph_msgs.msg import Clock

from hsv.graph.description import (
    ACTUATOR,
    CLOCK,
    EXIT_DIVERGED,
    FAULT_INJECTOR,
    FORCES,
    LAST_STATE,
    PLANT,
    READY,
    RECORDER,
    RECORDER_PROGRESS,
    RUN,
    STATE,
    peers,
)
from hsv.graph.exchange import fill_clock, fill_vehicle_forces, fill_vehicle_state, input_vector, stamp_of
from hsv.graph.part_parameters import PACE_PARAMETERS
from hsv.graph.progress import Standstill
from hsv.vehicle.plant import PLANT_PARAMETERS, FlightStatus, Plant
from hsv_node.lockstep import LINK_LOOK, LockstepNode, run_in_words, short_id, step_in_words
from hsv_node.main import run_node
from hsv_node.parameters import declare, refuse_sim_time
from hsv_node.qos import LATCHED, STEP
from hsv_plant.liveness import unresponsive

MAX_AHEAD = 100
"""Steps that the plant may be ahead of the recorder."""

LAST_WORDS = 1.0
"""Seconds for which a plant that ends waits for those whom it has told so; on a run that ends in order, a fraction."""


class PlantNode(LockstepNode):
    """Publishes state, forces and clock; one step per message of the actuators."""

    def __init__(self) -> None:
        super().__init__(PLANT, "flight")
        refuse_sim_time(self)
        self.values = declare(self, (*PLANT_PARAMETERS, *PACE_PARAMETERS))
        self.plant = Plant.from_parameters(self.values)
        self._peers = peers(PLANT, self.controller, self.recorded)
        self._ready: set[str] = set()
        self._state_message, self._forces_message = VehicleState(), VehicleForces()
        self._clock_message = Clock()
        self._state_publisher = self.create_step_publisher(STATE)
        self._clock_publisher = self.create_step_publisher(CLOCK)
        self._forces_publisher = self.create_step_publisher(FORCES)
        self.create_step_subscription(ACTUATOR, self._on_actuator)
        self._readies = self.create_subscription(Ready, READY, self._on_ready, LATCHED)
        self._confirmations = self.create_subscription(RecorderProgress, RECORDER_PROGRESS, self._on_progress, STEP)
        self._run = Run(run_id=uuid.uuid4().hex, period=self.plant.period, last_step=self.plant.steps)
        self._announcer = self.create_publisher(Run, RUN, LATCHED)
        self._announcer.publish(self._run)
        self._last_state = self.create_publisher(VehicleState, LAST_STATE, LATCHED)
        self._broken_off = ""
        """By what, if it was."""
        self._result = self.plant.reset()
        self._started = False
        self._recorded_step = -1
        self._actuator: np.ndarray | None = None
        self._flown = False
        self._begun = time.monotonic()
        self._messages = 0
        """Answers of the nodes so far: what must not stand still."""
        self._standstill = Standstill()

    def _on_ready(self, ready: Ready) -> None:
        if ready.run_id == self._run.run_id:
            self._ready.add(ready.node)

    def _on_progress(self, progress: RecorderProgress) -> None:
        self._recorded_step = progress.step
        self._messages += 1
        self._continue()

    def _on_actuator(self, message: ControlInput) -> None:
        if not self._started or message.step != self._result.step:
            self.say_foreign(ACTUATOR, message.step, self._result.step)
            return
        self._messages += 1
        if self._result.status is FlightStatus.RUNNING:
            self._actuator = input_vector(message)
        else:
            self._flown = True
        self._continue()

    def _continue(self) -> None:
        """Take the next step, unless its input, the recorder or the wall clock has to be waited for."""
        if self._flown and (not self.recorded or self._recorded_step >= self._result.step):
            self._land()
        elif self._actuator is not None and self._delay() <= 0.0 and self._room():
            actuator, self._actuator = self._actuator, None
            self._result = self.plant.step(actuator)
            self._publish()

    def _room(self) -> bool:
        return not self.recorded or self._result.step < self._recorded_step + MAX_AHEAD

    def _delay(self) -> float:
        """Return the wall time (s) until the next state is due."""
        factor = self.values["real_time_factor"]
        if factor == 0.0:
            return 0.0
        return self._begun + (self._result.step + 1) * self.plant.period / factor - time.monotonic()

    def _publish(self) -> None:
        result = self._result
        state, stamp = self._state_message, stamp_of(result.step, self.plant.period)
        fill_vehicle_state(result, stamp, state)
        # The state first: the other nodes work on it while the rest is published.
        self._state_publisher.publish(state)
        fill_vehicle_forces(result, stamp, self._forces_message)
        self._forces_publisher.publish(self._forces_message)
        fill_clock(stamp, self._clock_message)
        self._clock_publisher.publish(self._clock_message)
        if self.values["progress"] and (result.step % 50 == 0 or result.status is not FlightStatus.RUNNING):
            print(f"step {result.step} of {self.plant.steps}", flush=True)
        self.diagnose(state.header.stamp, step=result.step, status=result.status.name)

    def poll(self) -> None:
        """Start when everybody is ready, keep the pace, and name whoever is silent for too long."""
        if not self._started:
            self._try_start()
        else:
            self._continue()
            waited = self._standstill.look(self._messages)
            if waited > self.values["step_timeout"] + max(self._delay(), 0.0):
                self._give_up(waited)

    def wait_timeout(self) -> float:
        """Wake in time for the next state when paced."""
        if not self._started:
            return LINK_LOOK
        return min(max(self._delay(), 0.0), 0.25) if self._actuator is not None and self._room() else 0.25

    def stopped(self, signal_number: int) -> int:
        """Say that the flight is incomplete, unless whoever watches it has ended it by Ctrl-C."""
        self._broken_off = signal.Signals(signal_number).name
        return 0 if signal_number == signal.SIGINT else 128 + signal_number

    def close(self) -> None:
        """Say how the run ended, here and to the other nodes."""
        if not self._started:
            return
        run, where = f"run {short_id(self._run)}", step_in_words(self._state_message)
        match self._result.status:
            case FlightStatus.RUNNING:
                self.get_logger().info(f"{run} broken off at {where}: {self._broken_off or 'an error'}")
            case FlightStatus.FINISHED:
                self.get_logger().info(f"{run} finished at {where}")
        self._last_state.publish(self._state_message)
        self._last_state.wait_for_all_acked(Duration(seconds=LAST_WORDS))

    def _try_start(self) -> None:
        if self._is_ready() and self.links_are_counted() and not self.missing_links():
            self._started = True
            self._begun = time.monotonic()
            self._standstill = Standstill()
            self.get_logger().info(f"starts {run_in_words(self._run)}")
            self._publish()
            return
        self.say_waiting(self._missing, decides=True)
        limit = self.values["start_timeout"]
        if limit and time.monotonic() - self._begun > limit:
            self.get_logger().fatal(f"no start within {limit:g} s: still waiting for " + ", ".join(self._missing()))
            self.finish(1)

    def _is_ready(self) -> bool:
        return all(peer.name in self._ready for peer in self._peers)

    def _missing(self) -> list[str]:
        """Return what the start waits for."""
        unready = [peer.name for peer in self._peers if peer.name not in self._ready]
        return [f"{name} ({self._readies.topic_name})" for name in unready] or self.missing_links()

    def _give_up(self, waited: float) -> None:
        step = self._result.step
        behind_recorder = self._flown or not self._room()
        source, topic = (
            (RECORDER, self._confirmations.topic_name)
            if behind_recorder
            else (FAULT_INJECTOR, self.resolve_topic_name(ACTUATOR))
        )
        silent = unresponsive(self, self._peers)
        blame = f"no answer from {', '.join(silent)}" if silent else "all nodes answer, one of them is stuck"
        self.get_logger().fatal(f"step {step}: no {topic} (from {source.name}) for {waited:.1f} s; {blame}")
        self._broken_off = blame
        self.finish(1)

    def _land(self) -> None:
        result = self._result
        if result.status is FlightStatus.DIVERGED:
            self.get_logger().error(
                f"flight diverged at t = {result.step * self.plant.period:.2f} s: "
                f"angle of attack {result.state[2]:.3g} rad, pitch angle {result.state[3]:.3g} rad"
            )
        self.finish(EXIT_DIVERGED if result.status is FlightStatus.DIVERGED else 0)


def main(args: Sequence[str] | None = None) -> int:
    """Run the plant node."""
    return run_node(PlantNode, "plant", args)

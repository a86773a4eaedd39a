"""Control of the flight through the services of the ROS 2 package ``simulation_interfaces``."""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from simulation_interfaces import action, srv
from simulation_interfaces.msg import EntityState, Result, SimulationState, SimulatorFeatures

from hsv.bags.description import SIMULATE_STEPS, SIMULATION_CONTROL
from hsv.bags.messages import FRAME

if TYPE_CHECKING:
    from hsv_plant.plant import PlantNode

_FEATURES = [
    SimulatorFeatures.SIMULATION_RESET,
    SimulatorFeatures.SIMULATION_STATE_GETTING,
    SimulatorFeatures.SIMULATION_STATE_SETTING,
    SimulatorFeatures.SIMULATION_STATE_PAUSE,
    SimulatorFeatures.STEP_SIMULATION_SINGLE,
    SimulatorFeatures.STEP_SIMULATION_MULTIPLE,
    SimulatorFeatures.STEP_SIMULATION_ACTION,
    SimulatorFeatures.ENTITY_STATE_GETTING,
]

_VEHICLE = "vehicle"
"""Name of the one entity."""

_MAX_FILTER = 100
"""Maximum length of a filter of names, a regular expression"""

_WAITING_REQUESTS = 1000
"""Requests to step that wait in the queue of their service; the middleware drops more than that."""

_RESET_SCOPES = (srv.ResetSimulation.Request.SCOPE_DEFAULT, srv.ResetSimulation.Request.SCOPE_ALL)

_NAMES = {
    SimulationState.STATE_STOPPED: "stopped",
    SimulationState.STATE_PLAYING: "playing",
    SimulationState.STATE_PAUSED: "paused",
    SimulationState.STATE_QUITTING: "quitting",
}


class SimulationControl:
    """The services of ``simulation_interfaces`` on a plant. Pausing and playing set its parameter ``paused``.

    A flight that is paused before its first step counts as stopped. A request to reset is answered when it is accepted,
    a request to step when the steps are flown; while they are, the state is playing.
    """

    def __init__(self, plant: PlantNode) -> None:
        self._plant = plant
        self.stepping = Stepping(plant)
        for kind, name in SIMULATION_CONTROL.items():
            if kind != "StepSimulation":
                plant.create_service(getattr(srv, kind), name, getattr(self, f"_{name.removeprefix('hsv/')}"))

    @property
    def _state(self) -> int:
        if self._plant.exit_code is not None:
            return int(SimulationState.STATE_QUITTING)
        if not self._plant.paused:
            return int(SimulationState.STATE_PLAYING)
        return int(SimulationState.STATE_PAUSED if self._plant.step else SimulationState.STATE_STOPPED)

    def _get_simulator_features(self, _: Any, response: Any) -> Any:
        response.features.features = _FEATURES
        response.features.custom_info = "one vehicle; docs/simulation_control.md"
        return response

    def _get_simulation_state(self, _: Any, response: Any) -> Any:
        response.state.state = self._state
        return _answered(response)

    def _set_simulation_state(self, request: Any, response: Any) -> Any:
        state, target, kinds = self._state, request.state.state, srv.SetSimulationState.Response
        if target not in _NAMES:
            expected = ", ".join(f"{number} ({name})" for number, name in _NAMES.items())
            return _answered(response, Result.RESULT_FEATURE_UNSUPPORTED, f"state = {target}: expected {expected}")
        steps_are_flown = target == SimulationState.STATE_PLAYING and self._plant.values["paused"]
        if target == state and not steps_are_flown:
            return _answered(response, kinds.ALREADY_IN_TARGET_STATE, f"the flight is {_NAMES[state]} already")
        if (state, target) == (SimulationState.STATE_STOPPED, SimulationState.STATE_PAUSED):
            return _answered(response, kinds.INCORRECT_TRANSITION, "a stopped flight cannot be paused, only played")
        if target == SimulationState.STATE_QUITTING:
            self._plant.quit("SetSimulationState, quitting")
            return _answered(response)
        paused = target != SimulationState.STATE_PLAYING
        [done] = self._plant.set_parameters([Parameter("paused", value=paused)])
        if not done.successful:
            return _answered(response, kinds.STATE_TRANSITION_ERROR, done.reason)
        return self._reset(response) if target == SimulationState.STATE_STOPPED else _answered(response)

    def _get_entities(self, request: Any, response: Any) -> Any:
        return _answered(response, *self._select(request.filters, response))

    def _get_entities_states(self, request: Any, response: Any) -> Any:
        result, words = self._select(request.filters, response)
        response.states = [self._entity_state() for _ in response.entities]
        return _answered(response, result, words)

    def _get_entity_state(self, request: Any, response: Any) -> Any:
        if request.entity != _VEHICLE:
            return _answered(
                response, Result.RESULT_NOT_FOUND, f"entity = {request.entity!r:.80}: expected {_VEHICLE!r}"
            )
        response.state = self._entity_state()
        return _answered(response)

    def _select(self, filters: Any, response: Any) -> tuple[int, str]:
        """Write the names of the entities that the filters admit; return result code and message."""
        if filters.categories or filters.tags.tags or filters.bounds.type:
            return Result.RESULT_FEATURE_UNSUPPORTED, "filters: expected a filter of names only"
        # Each choice multiplies the work of the search, which stops the flight.
        if len(filters.filter) > _MAX_FILTER or "{" in filters.filter or sum(map(filters.filter.count, "*+?|")) > 4:
            expected = f"expected at most {_MAX_FILTER} characters, 4 of them among * + ? |, and no {{"
            return Result.RESULT_FEATURE_UNSUPPORTED, f"filters.filter: {expected}"
        try:
            admitted = not filters.filter or re.search(filters.filter, _VEHICLE)
        except (re.error, RecursionError) as error:
            return Result.RESULT_OPERATION_FAILED, f"filters.filter = {filters.filter!r}: {error}"
        response.entities = [_VEHICLE] if admitted else []
        return Result.RESULT_OK, ""

    def _entity_state(self) -> EntityState:
        """Return attitude and velocity in the vehicle-carried frame: x forward, y to the left, z up."""
        _, velocity, alpha, pitch, rate, *_ = self._plant.state
        found = EntityState()
        found.header.frame_id = FRAME
        found.header.stamp.sec, found.header.stamp.nanosec = self._plant.stamp
        # A positive pitch angle raises the nose, a rotation against the y axis.
        found.pose.orientation.y, found.pose.orientation.w = -math.sin(0.5 * pitch), math.cos(0.5 * pitch)
        path = pitch - alpha
        found.twist.linear.x, found.twist.linear.z = velocity * math.cos(path), velocity * math.sin(path)
        found.twist.angular.y = -rate
        return found

    def _reset_simulation(self, request: Any, response: Any) -> Any:
        if request.scope not in _RESET_SCOPES:
            expected = " or ".join(map(str, _RESET_SCOPES))
            words = f"scope = {request.scope}: expected {expected}, everything"
            return _answered(response, Result.RESULT_FEATURE_UNSUPPORTED, words)
        return self._reset(response)

    def _reset(self, response: Any) -> Any:
        if self._plant.reset():
            return _answered(response)
        return _answered(response, Result.RESULT_OPERATION_FAILED, "the flight is over: expected one in the air")


def _answered(response: Any, result: int = Result.RESULT_OK, words: str = "") -> Any:
    response.result.result, response.result.error_message = result, words
    return response


class Stepping:
    """Service and action that are answered when the requested steps are flown.

    Their callbacks wait, which those of the plant's executor cannot: they belong to a node of their own, whose threads
    sleep until a request arrives. Requests are served one after the other.
    """

    def __init__(self, plant: PlantNode) -> None:
        self._plant = plant
        self._one = threading.Lock()
        self._moved = threading.Condition()
        self._over = False
        self._node = rclpy.create_node(
            f"_{plant.get_name()}_stepping",
            namespace=plant.get_namespace(),
            context=plant.context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        self._service = self._node.create_service(
            srv.StepSimulation,
            plant.resolve_service_name(SIMULATION_CONTROL["StepSimulation"]),
            self._step,
            qos_profile=QoSProfile(depth=_WAITING_REQUESTS),
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
        self._action = ActionServer(
            self._node,
            action.SimulateSteps,
            plant.resolve_service_name(SIMULATE_STEPS),
            self._simulate,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )
        self._executor = MultiThreadedExecutor(3, context=plant.context)  # a service, an action and its cancellation
        self._executor.add_node(self._node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def moved(self) -> None:
        """Notify waiting requests that the flight has moved, has been paused or has begun anew."""
        with self._moved:
            self._moved.notify_all()

    def close(self) -> None:
        """Answer waiting requests, and end."""
        self._over = True
        self.moved()
        with self._one:  # the last answer is on its way
            self._executor.shutdown(timeout_sec=1.0)
        self._thread.join(1.0)
        self._action.destroy()
        self._node.destroy_node()

    def _step(self, request: Any, response: Any) -> Any:
        return _answered(response, *self._fly(request.steps, lambda _: True))

    def _simulate(self, goal: Any) -> Any:
        steps, feedback, told = goal.request.steps, action.SimulateSteps.Feedback(), -1

        def report(flown: int) -> bool:
            nonlocal told
            if flown != told:
                told = flown
                feedback.completed_steps, feedback.remaining_steps = flown, steps - flown
                goal.publish_feedback(feedback)
            return not goal.is_cancel_requested

        code, words = self._fly(steps, report)
        if code == Result.RESULT_OK:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return _answered(action.SimulateSteps.Result(), code, words)

    def _fly(self, steps: int, report: Callable[[int], bool]) -> tuple[int, str]:
        """Fly ``steps`` steps of a paused flight; return result code and message.

        ``report`` is called with the number of steps flown so far; if it returns False, the flight is paused.
        """
        with self._one, self._moved:
            begun: list[tuple[str, int]] = []
            self._in_plant(lambda: begun.append(self._begin(steps)))
            self._moved.wait_for(lambda: begun or self._over)
            if not begun or not begun[0][0]:
                return Result.RESULT_OPERATION_FAILED, "the flight is playing or over: expected a paused one"
            run, first = begun[0]
            while True:
                same, flown = self._plant.run_id == run, self._plant.step - first
                played = not self._plant.values["paused"]
                ended = self._over or played or not same or self._plant.paused
                if not report(flown if same else 0) and not ended:
                    self._in_plant(lambda: self._plant.fly_on(0))
                if ended:
                    break
                self._moved.wait(0.1)
        if same and flown == steps:
            return Result.RESULT_OK, ""
        why = "ended" if self._over else "was reset" if not same else "was played" if played else "was paused"
        return Result.RESULT_OPERATION_FAILED, f"the flight {why} after {flown if same else 0} of {steps} steps"

    def _begin(self, steps: int) -> tuple[str, int]:
        """Begin to fly in the plant's thread; return run and step, an empty run if the flight is not paused."""
        if not self._plant.paused:
            return "", 0
        found = self._plant.run_id, self._plant.step
        self._plant.fly_on(steps)
        return found

    def _in_plant(self, task: Callable[[], object]) -> None:
        def run() -> None:
            task()
            self.moved()

        while (executor := self._plant.executor) is None:  # the plant is still being made
            time.sleep(0.01)
        executor.create_task(run)

"""Control of the flight through the services of the ROS 2 package ``simulation_interfaces``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.parameter import Parameter
from simulation_interfaces import srv
from simulation_interfaces.msg import Result, SimulationState, SimulatorFeatures

from hsv.bags.description import SIMULATION_CONTROL

if TYPE_CHECKING:
    from hsv_plant.plant import PlantNode

_FEATURES = [
    SimulatorFeatures.SIMULATION_RESET,
    SimulatorFeatures.SIMULATION_STATE_GETTING,
    SimulatorFeatures.SIMULATION_STATE_SETTING,
    SimulatorFeatures.SIMULATION_STATE_PAUSE,
    SimulatorFeatures.STEP_SIMULATION_SINGLE,
    SimulatorFeatures.STEP_SIMULATION_MULTIPLE,
]

_RESET_SCOPES = (srv.ResetSimulation.Request.SCOPE_DEFAULT, srv.ResetSimulation.Request.SCOPE_ALL)

_NAMES = {
    SimulationState.STATE_STOPPED: "stopped",
    SimulationState.STATE_PLAYING: "playing",
    SimulationState.STATE_PAUSED: "paused",
    SimulationState.STATE_QUITTING: "quitting",
}


class SimulationControl:
    """The services of ``simulation_interfaces`` on a plant. Pausing and playing set its parameter ``paused``.

    A flight that is paused before its first step counts as stopped. Requests to reset or to step are answered when they
    are accepted, because the plant cannot step within a service. While requested steps run, the state is playing.
    """

    def __init__(self, plant: PlantNode) -> None:
        self._plant = plant
        for kind, name in SIMULATION_CONTROL.items():
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

    def _step_simulation(self, request: Any, response: Any) -> Any:
        if not self._plant.paused:
            words = f"the flight is {_NAMES[self._state]}: expected a paused one"
            return _answered(response, Result.RESULT_OPERATION_FAILED, words)
        self._plant.fly_on(request.steps)
        return _answered(response)

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

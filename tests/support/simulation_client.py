"""A client of simulation_interfaces without knowledge of the bench: it pauses, steps, resets and prints the states."""

import json
import math
import time

import rclpy
from hsv_msgs.msg import VehicleState
from rclpy.action import ActionClient
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_sensor_data
from simulation_interfaces import srv
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import SimulationState

SERVICES = {
    srv.GetSimulatorFeatures: "hsv/get_simulator_features",
    srv.GetSimulationState: "hsv/get_simulation_state",
    srv.SetSimulationState: "hsv/set_simulation_state",
    srv.StepSimulation: "hsv/step_simulation",
    srv.ResetSimulation: "hsv/reset_simulation",
    srv.GetEntities: "hsv/get_entities",
    srv.GetEntityState: "hsv/get_entity_state",
    srv.GetEntitiesStates: "hsv/get_entities_states",
}

rclpy.init()
node = rclpy.create_node("simulation_client")
clients = {kind: node.create_client(kind, name) for kind, name in SERVICES.items()}
actions = ActionClient(node, SimulateSteps, "hsv/simulate_steps")
seen = []
node.create_subscription(VehicleState, "hsv/state", seen.append, qos_profile_sensor_data)


def call(kind, **fields):
    clients[kind].wait_for_service()
    future = clients[kind].call_async(kind.Request(**fields))
    rclpy.spin_until_future_complete(node, future)
    return future.result()


def go(state):
    return int(call(srv.SetSimulationState, state=SimulationState(state=state)).result.result)


def paused_at():
    """Return the last state, once the flight is paused and no more states arrive."""
    while call(srv.GetSimulationState).state.state != SimulationState.STATE_PAUSED or last_is_new():
        time.sleep(0.05)
    return seen[-1]


def last_is_new():
    count, end = len(seen), time.monotonic() + 0.5
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)
    return len(seen) != count or not seen


def act(steps, cancel_at):
    """Simulate steps by the action, and cancel it after ``cancel_at`` steps; return status, result and feedback."""
    feedback = []
    goal = actions.send_goal_async(SimulateSteps.Goal(steps=steps), lambda message: feedback.append(message.feedback))
    rclpy.spin_until_future_complete(node, goal)
    result = goal.result().get_result_async()
    while cancel_at is not None and not any(each.completed_steps >= cancel_at for each in feedback):
        rclpy.spin_once(node, timeout_sec=0.1)
    if cancel_at is not None:
        rclpy.spin_until_future_complete(node, goal.result().cancel_goal_async())
    rclpy.spin_until_future_complete(node, result)
    return result.result().status, result.result().result.result.result, feedback[-1].completed_steps


told = {"features": list(call(srv.GetSimulatorFeatures).features.features)}
told["at first"] = call(srv.GetSimulationState).state.state
told["pause while stopped"] = go(SimulationState.STATE_PAUSED)
told["steps at first"] = [call(srv.StepSimulation, steps=steps).result.result for steps in (1, 1, 3)]
rclpy.spin_once(node, timeout_sec=0.5)
told["at"] = max(state.step for state in seen)
waiting = clients[srv.StepSimulation].call_async(srv.StepSimulation.Request(steps=1000))
while call(srv.GetSimulationState).state.state != SimulationState.STATE_PLAYING:
    pass
told["play while steps are flown"] = go(SimulationState.STATE_PLAYING)
rclpy.spin_until_future_complete(node, waiting)
told["steps of a played flight"] = waiting.result().result.result
told["play"] = go(SimulationState.STATE_PLAYING)
told["step while playing"] = call(srv.StepSimulation, steps=1).result.result
while not seen or seen[-1].step < 20:
    rclpy.spin_once(node, timeout_sec=0.1)
told["pause"] = [go(SimulationState.STATE_PAUSED), go(SimulationState.STATE_PAUSED)]
first = paused_at()
told["steps"] = call(srv.StepSimulation, steps=50).result.result
second = paused_at()
told["entities"] = list(call(srv.GetEntities).entities)
[entity] = call(srv.GetEntitiesStates).states
told["pitch"] = [2.0 * math.asin(-entity.pose.orientation.y), second.pitch_angle]
told["unknown entity"] = call(srv.GetEntityState, entity="glider").result.result
told["action"] = [act(30, None), act(100_000, 5)]
told["last"] = paused_at().step
told["from"], told["to"] = first.step, second.step
names = [name for name in VehicleState.get_fields_and_field_types() if name not in ("header", "step", "status")]
told["state"] = [getattr(second, name) for name in names]
told["scope"] = call(srv.ResetSimulation, scope=srv.ResetSimulation.Request.SCOPE_TIME).result.result
told["reset"] = call(srv.ResetSimulation).result.result
told["after reset"] = call(srv.GetSimulationState).state.state
faster = AsyncParameterClient(node, "plant").set_parameters([Parameter("real_time_factor", value=0.0)])
rclpy.spin_until_future_complete(node, faster)
told["play again"] = go(SimulationState.STATE_PLAYING)
print(json.dumps(told))

"""A client of simulation_interfaces without knowledge of the bench: it pauses, steps, resets and prints the states."""

import json
import time

import rclpy
from hsv_msgs.msg import VehicleState
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import qos_profile_sensor_data
from simulation_interfaces import srv
from simulation_interfaces.msg import SimulationState

SERVICES = {
    srv.GetSimulatorFeatures: "hsv/get_simulator_features",
    srv.GetSimulationState: "hsv/get_simulation_state",
    srv.SetSimulationState: "hsv/set_simulation_state",
    srv.StepSimulation: "hsv/step_simulation",
    srv.ResetSimulation: "hsv/reset_simulation",
}

rclpy.init()
node = rclpy.create_node("simulation_client")
clients = {kind: node.create_client(kind, name) for kind, name in SERVICES.items()}
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


told = {"features": list(call(srv.GetSimulatorFeatures).features.features)}
told["at first"] = call(srv.GetSimulationState).state.state
told["pause while stopped"] = go(SimulationState.STATE_PAUSED)
told["steps at first"] = call(srv.StepSimulation, steps=1000).result.result
told["play while steps are flown"] = go(SimulationState.STATE_PLAYING)
told["play"] = go(SimulationState.STATE_PLAYING)
told["step while playing"] = call(srv.StepSimulation, steps=1).result.result
while not seen or seen[-1].step < 20:
    rclpy.spin_once(node, timeout_sec=0.1)
told["pause"] = [go(SimulationState.STATE_PAUSED), go(SimulationState.STATE_PAUSED)]
first = paused_at()
told["steps"] = call(srv.StepSimulation, steps=50).result.result
second = paused_at()
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

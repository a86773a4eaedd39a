"""A client of simulation_interfaces that sends random requests: ``python3 simulation_fuzz.py REQUESTS [SEED]``.

Every request must be answered. Steps that are flown are paused, so that no request waits for the end of the flight. It
prints how many requests each service answered.
"""

import json
import math
import random
import sys
import time
from importlib import import_module

import rclpy
from rclpy.action import ActionClient
from rclpy.qos import qos_profile_services_default
from simulation_interfaces import srv
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import SimulationState

KINDS = ("GetEntities", "GetEntitiesStates", "GetEntityState", "GetSimulationState", "GetSimulatorFeatures")
KINDS += ("ResetSimulation", "SetSimulationState", "StepSimulation")
TEXTS = (
    "",
    "vehicle",
    "(",
    "[",
    "(.*)*" * 20 + "x",
    "(" * 5000,
    "(|)" * 30 + "x",
    "v{99999999}",
    "\u202e\x1b[31m\n",
    "x" * 10**6,
)
NUMBERS = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e308, math.inf, -math.inf, math.nan)
STEPS = (0, 1, 2, 7, 50, 10**4, 2**31, 2**32, 2**63, 2**64 - 1)
LIMITS = {"uint8": 2**8, "uint16": 2**16, "uint32": 2**32, "uint64": 2**64}
PATIENCE = 30.0


def value(kind, drawn):
    """Return a random value of a field of the type ``kind``."""
    if kind.startswith("sequence<"):
        return [value(kind[9:-1], drawn) for _ in range(drawn.choice((0, 0, 1, 3)))]
    if kind == "string":
        return drawn.choice(TEXTS)
    if kind == "boolean":
        return drawn.random() < 0.5
    if kind in ("double", "float"):
        return drawn.choice(NUMBERS)
    if kind in LIMITS:
        return drawn.choice([n for n in (*range(6), *STEPS) if n < LIMITS[kind]])
    if kind.startswith("int"):
        return drawn.choice((0, 1, -1, 2**31 - 1, -(2**31)))
    package, name = kind.split("/")
    return filled(getattr(import_module(f"{package}.msg"), name)(), drawn)


def filled(message, drawn):
    """Fill a ``message`` with random values, about half of its fields."""
    for name, kind in message.get_fields_and_field_types().items():
        if drawn.random() < 0.6:
            setattr(message, name, value(kind, drawn))
    return message


def answered(node, future, urge):
    """Return the answer; while it is missing, call ``urge``."""
    began = time.monotonic()
    while not future.done():
        rclpy.spin_until_future_complete(node, future, timeout_sec=0.2)
        if not future.done():
            urge()
        assert time.monotonic() - began < PATIENCE, "no answer"
    return future.result()


def main(requests, seed):
    drawn = random.Random(seed)
    rclpy.init()
    node = rclpy.create_node("simulation_fuzz")
    clients = {}
    for kind in KINDS:
        name = "hsv/" + "".join(f"_{c.lower()}" if c.isupper() else c for c in kind)[1:]
        clients[kind] = node.create_client(getattr(srv, kind), name, qos_profile=qos_profile_services_default)
        assert clients[kind].wait_for_service(PATIENCE)
    steps = ActionClient(node, SimulateSteps, "hsv/simulate_steps")
    assert steps.wait_for_server(PATIENCE)
    pause = srv.SetSimulationState.Request(state=SimulationState(state=SimulationState.STATE_PAUSED))

    def urge():
        clients["SetSimulationState"].call_async(pause)

    counts = dict.fromkeys((*KINDS, "SimulateSteps"), 0)
    for _ in range(requests):
        kind = drawn.choice([*counts])
        if kind == "SimulateSteps":
            goal = answered(node, steps.send_goal_async(filled(SimulateSteps.Goal(), drawn)), urge)
            if goal.accepted:
                result = goal.get_result_async()
                if drawn.random() < 0.5:
                    goal.cancel_goal_async()
                answered(node, result, urge)
        else:
            request = filled(getattr(srv, kind).Request(), drawn)
            if kind == "SetSimulationState" and request.state.state == SimulationState.STATE_QUITTING:
                request.state.state = SimulationState.STATE_PAUSED
            answer = answered(node, clients[kind].call_async(request), urge)
            words = answer.result.error_message if hasattr(answer, "result") else ""
            assert "\n" not in words and len(words) <= 2000, words
        counts[kind] += 1
    print(json.dumps(counts))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else time.time_ns())

"""The processes that a bag can repeat, as data: what each is made of, what it does in a step, how equal is equal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from hsv.control.nominal_trajectory import NominalTrajectory
from hsv.control.notch_filter import NotchFilter
from hsv.control.robust_mpc import RobustMpc
from hsv.control.tube_law import TubeLaw
from hsv.faults.actuator import FaultInjector
from hsv.graph import exchange
from hsv.graph.description import (
    FAULT_INJECTOR,
    NOMINAL_TRAJECTORY,
    NOTCH_FILTER,
    PLANT,
    ROBUST_MPC,
    STATE,
    TUBE_MPC,
    NodeDescription,
)
from hsv.vehicle.plant import Plant

Messages = Sequence[Any]
MessageClass = Callable[[str], Callable[..., Any]]
"""From ``package/msg/Type`` to what makes a message of it."""


@dataclass(frozen=True)
class Process:
    """A process under test; what it reads and writes is in its ``node`` description."""

    node: NodeDescription
    build: Callable[[Mapping[str, Any]], Any]
    """From the flat parameters to the component."""
    step: Callable[[Any, Messages, Messages, MessageClass], None]
    """From component and input messages to the output messages, filled in place."""
    tolerance: float
    """Absolute and relative at once; at most 1e-10."""
    reason: str
    """Why that much."""
    ignored: tuple[str, ...] = ()
    """Field paths that do not count."""
    restarts: bool = False
    """Owner of time: a step begins from the recorded state and input of the step before, the first from nothing."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Topics that one step needs."""
        return (*self.node.subscribes, STATE) if self.restarts else self.node.subscribes

    @property
    def outputs(self) -> tuple[str, ...]:
        """Topics that one step gives."""
        return self.node.publishes


def _filter(notch: NotchFilter, inputs: Messages, outputs: Messages, _: MessageClass) -> None:
    exchange.filter_state(notch, *inputs, *outputs)


def _plan(trajectory: NominalTrajectory, inputs: Messages, outputs: Messages, _: MessageClass) -> None:
    exchange.plan_nominal(trajectory, *inputs, *outputs)


def _control(follows_nominal: bool, law: Any, inputs: Messages, outputs: Messages, _: MessageClass) -> None:
    filtered, nominal = inputs
    command, status = outputs
    result = exchange.control(law, filtered, nominal, command)
    exchange.fill_tube_status(result, filtered, nominal, follows_nominal, status)


def _actuate(injector: FaultInjector, inputs: Messages, outputs: Messages, message_class: MessageClass) -> None:
    (command,) = inputs
    actuator, status = outputs
    result = exchange.actuate(injector, command, actuator)
    exchange.fill_fault_status(result, command, message_class("hsv_msgs/msg/Fault"), status)


def _integrate(plant: Plant, inputs: Messages, outputs: Messages, _: MessageClass) -> None:
    if inputs:
        actuator, state = inputs
        plant.place(state.step, exchange.state_vector(state))
        result = plant.step(exchange.input_vector(actuator))
    else:
        result = plant.reset()
    clock, state, forces = outputs
    stamp = exchange.stamp_of(result.step, plant.period)
    exchange.fill_clock(stamp, clock)
    exchange.fill_vehicle_state(result, stamp, state)
    exchange.fill_vehicle_forces(result, stamp, forces)


PROCESSES = {
    process.node.name: process
    for process in (
        Process(
            PLANT,
            Plant.from_parameters,
            _integrate,
            1e-10,
            "one period from the recorded state: the vehicle alone is unstable, a longer flight without its controller "
            "would magnify the last bit in which flights from before the portable arithmetic differ",
            restarts=True,
        ),
        Process(
            NOTCH_FILTER,
            NotchFilter.from_parameters,
            _filter,
            1e-12,
            "a stable filter: other roundings of its coefficients, as before the portable arithmetic, die out",
        ),
        Process(
            NOMINAL_TRAJECTORY,
            NominalTrajectory.from_parameters,
            _plan,
            1e-10,
            "a contracting system that runs on its own for the whole flight; laws solved in flight stop at a tolerance",
        ),
        Process(
            TUBE_MPC,
            TubeLaw.from_parameters,
            partial(_control, True),
            1e-10,
            "the level in the set is a quadratic form whose terms of both signs nearly cancel",
        ),
        Process(
            ROBUST_MPC,
            RobustMpc.from_parameters,
            partial(_control, False),
            1e-12,
            "one matrix product without memory",
        ),
        Process(
            FAULT_INJECTOR,
            FaultInjector.from_parameters,
            _actuate,
            0.0,
            "one multiplication, the same on every processor",
        ),
    )
}
"""By node, in the order in which a step passes through them; of the controllers the one that flew."""

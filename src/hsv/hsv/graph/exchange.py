"""From messages to the components and back: what each process of the graph does in a step.

The nodes call these functions with ROS 2 messages, the replay with those of a bag's own definitions. Messages are
objects with the fields of their type as attributes; those handed out are filled in place.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.controller import ControllerInput

if TYPE_CHECKING:  # a node imports its own component alone
    from hsv.control.nominal_trajectory import NominalResult, NominalTrajectory
    from hsv.control.notch_filter import NotchFilter, NotchResult
    from hsv.control.robust_mpc import RobustMpc
    from hsv.control.tube_law import TubeLaw, TubeResult
    from hsv.faults.actuator import FaultInjector, FaultResult
    from hsv.vehicle.plant import PlantResult

Message = Any

NO_GAIN = np.empty(0)


def state_vector(message: Message) -> np.ndarray:
    """Return x (9) from a message with the fields of LongitudinalState."""
    coordinate, rate = message.elastic_coordinate, message.elastic_rate
    return np.array(
        (
            message.altitude,
            message.velocity,
            message.angle_of_attack,
            message.pitch_angle,
            message.pitch_rate,
            coordinate[0],
            rate[0],
            coordinate[1],
            rate[1],
        )
    )


def fill_state(message: Message, x: np.ndarray) -> None:
    """Write x (9) into the fields of LongitudinalState of ``message``."""
    (
        message.altitude,
        message.velocity,
        message.angle_of_attack,
        message.pitch_angle,
        message.pitch_rate,
        coordinate_1,
        rate_1,
        coordinate_2,
        rate_2,
    ) = x.tolist()
    message.elastic_coordinate[:] = coordinate_1, coordinate_2
    message.elastic_rate[:] = rate_1, rate_2


def input_vector(message: Message) -> np.ndarray:
    """Return u (2) from a message with the fields of InputVector."""
    return np.array((message.fuel_equivalence_ratio, message.elevator_deflection))


def fill_input(message: Message, u: np.ndarray) -> None:
    """Write u (2) into the fields of InputVector of ``message``."""
    message.fuel_equivalence_ratio, message.elevator_deflection = u.tolist()


def stamp_of(step: int, period: float) -> tuple[int, int]:
    """Return seconds and nanoseconds of simulated time at ``step``."""
    return divmod(round(step * period * 1e9), 1_000_000_000)


def fill_vehicle_state(result: PlantResult, stamp: tuple[int, int], state: Message) -> None:
    """Fill VehicleState from a step of the plant."""
    state.header.stamp.sec, state.header.stamp.nanosec = stamp
    state.step = result.step
    fill_state(state, result.state)
    state.status = int(result.status)


def fill_vehicle_forces(result: PlantResult, stamp: tuple[int, int], forces: Message) -> None:
    """Fill VehicleForces from a step of the plant."""
    forces.header.stamp.sec, forces.header.stamp.nanosec = stamp
    forces.step = result.step
    forces.lift, forces.drag, forces.thrust, forces.pitching_moment, forces.dynamic_pressure = result.forces


def fill_clock(stamp: tuple[int, int], clock: Message) -> None:
    """Fill Clock."""
    clock.clock.sec, clock.clock.nanosec = stamp


def filter_state(notch: NotchFilter, state: Message, filtered: Message) -> NotchResult:
    """Step the notch filter: VehicleState to FilteredState."""
    result = notch.step(state.pitch_rate)
    filtered.header, filtered.step, filtered.status = state.header, state.step, state.status
    copy = filtered.state
    copy.altitude, copy.velocity = state.altitude, state.velocity
    copy.angle_of_attack, copy.pitch_angle, copy.pitch_rate = state.angle_of_attack, state.pitch_angle, state.pitch_rate
    copy.elastic_coordinate, copy.elastic_rate = state.elastic_coordinate, state.elastic_rate
    filtered.filtered_pitch_rate = result.filtered_pitch_rate
    filtered.filter_state = result.filter_state
    return result


def plan_nominal(trajectory: NominalTrajectory, state: Message, nominal: Message) -> NominalResult:
    """Step the nominal trajectory: VehicleState to NominalState."""
    result = trajectory.step(state_vector(state))
    nominal.header, nominal.step = state.header, state.step
    fill_state(nominal.reference, result.reference)
    fill_input(nominal.reference_input, result.reference_input)
    fill_state(nominal.deviation, result.deviation)
    fill_input(nominal.input, result.input)
    nominal.gain = NO_GAIN if result.in_family else result.gain.ravel()
    nominal.gain_index, nominal.status = result.gain_index, int(result.status)
    return result


def control(law: TubeLaw | RobustMpc, filtered: Message, nominal: Message, command: Message) -> TubeResult:
    """Step the controller: FilteredState and NominalState to ControlInput."""
    result = law.step(
        ControllerInput(
            filtered.step,
            state_vector(filtered.state),
            filtered.filtered_pitch_rate,
            np.asarray(filtered.filter_state),
            state_vector(nominal.reference),
            input_vector(nominal.reference_input),
            state_vector(nominal.deviation),
            input_vector(nominal.input),
        )
    )
    command.header, command.step = filtered.header, filtered.step
    fill_input(command, result.input)
    return result


def fill_tube_status(
    result: TubeResult, filtered: Message, nominal: Message, follows_nominal: bool, status: Message
) -> None:
    """Fill TubeStatus from a step of the controller; ``follows_nominal``: the nominal input is part of its command."""
    status.header, status.step = filtered.header, filtered.step
    status.error = result.error
    status.tube_centre, status.tube_half_width = result.tube_centre, result.tube_half_width
    status.level, status.inside = result.level, result.inside
    if follows_nominal:
        status.u_nominal = nominal.input
    status.u_reference = nominal.reference_input
    fill_input(status.u_feedback, result.u_feedback)
    fill_input(status.u_unsaturated, result.u_unsaturated)
    status.saturated[:] = result.saturated.tolist()
    status.tau, status.status = result.tau, int(result.status)


def actuate(injector: FaultInjector, command: Message, actuator: Message) -> FaultResult:
    """Step the fault injector: ControlInput of the controller to ControlInput of the actuators."""
    result = injector.step(command.step, input_vector(command))
    actuator.header, actuator.step = command.header, command.step
    fill_input(actuator, result.actuator)
    return result


def fill_fault_status(result: FaultResult, command: Message, fault: Callable[..., Message], status: Message) -> None:
    """Fill FaultStatus from a step of the fault injector; ``fault`` makes a message Fault."""
    status.header, status.step = command.header, command.step
    status.active = [fault(channel=f.channel, type=f.type, value=f.value) for f in result.active]

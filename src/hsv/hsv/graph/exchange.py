"""Conversion between messages and the signals of the loop, with one pair of functions per topic.

The replay uses them with the messages of a bag's own definitions. Messages are objects with the fields of their type as
attributes; those handed out are filled in place. The nodes convert their step messages without an object, by
``hsv_node.wire``; its tests hold it against these.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.errors import ParameterError
from hsv.graph.description import (
    ACTUATOR,
    CLOCK,
    COMMAND,
    FILTERED_STATE,
    FORCES,
    MEASUREMENT,
    NOMINAL,
    STATE,
    TUBE_STATUS,
)

if TYPE_CHECKING:
    from hsv.faults.schedule import ActiveFault
    from hsv.faults.table import Fault
    from hsv.simulation.blocks import Signals

Message = Any
MessageClass = Callable[[str], Callable[..., Message]]
"""Function from ``package/msg/Type`` to the class of the message."""


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


def _place(message: Message, signals: Signals) -> None:
    signals.header, signals.step = message.header, message.step


def _read_measurement(message: Message, signals: Signals) -> None:
    _place(message, signals)
    signals.measurement, signals.status = state_vector(message.state), message.status


def _read_state(message: Message, signals: Signals) -> None:
    _place(message, signals)
    signals.state, signals.status = state_vector(message), message.status


def _read_filtered_state(message: Message, signals: Signals) -> None:
    _read_measurement(message, signals)
    # Bags from before there were estimators lack the field.
    estimated = getattr(message, "estimate", ())
    signals.estimate = np.asarray(estimated) if len(estimated) else signals.measurement
    signals.filtered_pitch_rate = message.filtered_pitch_rate
    signals.filter_state = np.asarray(message.filter_state)


def _read_nominal(message: Message, signals: Signals) -> None:
    _place(message, signals)
    signals.reference, signals.reference_input = state_vector(message.reference), input_vector(message.reference_input)
    signals.deviation, signals.nominal_input = state_vector(message.deviation), input_vector(message.input)


def _read_command(message: Message, signals: Signals) -> None:
    _place(message, signals)
    signals.command = input_vector(message)


def _read_actuator(message: Message, signals: Signals) -> None:
    _place(message, signals)
    signals.actuator = input_vector(message)
    signals.active_faults = active_faults(message) if message.active else ()


READ: dict[str, Callable[[Message, Signals], None]] = {
    MEASUREMENT: _read_measurement,
    STATE: _read_state,
    FILTERED_STATE: _read_filtered_state,
    NOMINAL: _read_nominal,
    COMMAND: _read_command,
    ACTUATOR: _read_actuator,
}
"""Functions by topic, from its message to the signals."""


def stamp_of(step: int, period: float) -> tuple[int, int]:
    """Return seconds and nanoseconds of simulated time at ``step``."""
    return divmod(round(step * period * 1e9), 1_000_000_000)


def _begin(signals: Signals, message: Message) -> None:
    """Head a message of the plant, with which a step begins."""
    message.header.stamp.sec, message.header.stamp.nanosec = stamp_of(signals.step, signals.period)
    message.step = signals.step


def _answer(signals: Signals, message: Message) -> None:
    """Head a message with what those that it answers are headed."""
    message.header, message.step = signals.header, signals.step


def _fill_clock(signals: Signals, clock: Message, _: MessageClass) -> None:
    clock.clock.sec, clock.clock.nanosec = stamp_of(signals.step, signals.period)


def _fill_measurement(signals: Signals, measurement: Message, _: MessageClass) -> None:
    _begin(signals, measurement)
    fill_state(measurement.state, signals.measurement)
    measurement.status = int(signals.status)


def _fill_vehicle_state(signals: Signals, state: Message, _: MessageClass) -> None:
    _begin(signals, state)
    fill_state(state, signals.state)
    state.status = int(signals.status)


def _fill_forces(signals: Signals, forces: Message, _: MessageClass) -> None:
    _begin(signals, forces)
    forces.lift, forces.drag, forces.thrust, forces.pitching_moment, forces.dynamic_pressure = signals.forces
    fill_input(forces.effector, signals.effector)
    forces.wind_forward, forces.wind_up, forces.density_factor = signals.air.tolist()


def _fill_filtered_state(signals: Signals, filtered: Message, _: MessageClass) -> None:
    _answer(signals, filtered)
    fill_state(filtered.state, signals.measurement)
    filtered.filtered_pitch_rate = signals.filtered_pitch_rate
    filtered.filter_state = signals.filter_state
    filtered.estimate = _NO_ESTIMATE if signals.estimate is signals.measurement else signals.estimate
    filtered.status = signals.status


_NO_ESTIMATE = np.empty(0)


def _fill_nominal(signals: Signals, nominal: Message, _: MessageClass) -> None:
    _answer(signals, nominal)
    fill_state(nominal.reference, signals.reference)
    fill_input(nominal.reference_input, signals.reference_input)
    fill_state(nominal.deviation, signals.deviation)
    fill_input(nominal.input, signals.nominal_input)
    nominal.gain = signals.gain.ravel()
    nominal.gain_index, nominal.status = signals.gain_index, int(signals.nominal_status)


def _fill_command(signals: Signals, command: Message, _: MessageClass) -> None:
    _answer(signals, command)
    fill_input(command, signals.command)
    command.saturated[:] = signals.saturated.tolist()


def _fill_tube_status(signals: Signals, status: Message, _: MessageClass) -> None:
    _answer(signals, status)
    result: Any = signals.diagnostics
    status.error = result.error
    status.tube_centre, status.tube_half_width = result.tube_centre, result.tube_half_width
    status.level, status.inside = result.level, result.inside
    fill_input(status.u_nominal, result.u_nominal)
    fill_input(status.u_reference, signals.reference_input)
    fill_input(status.u_feedback, result.u_feedback)
    fill_input(status.u_unsaturated, result.u_unsaturated)
    status.tau, status.status = result.tau, int(result.status)


def fault_in(message: Message) -> Fault:
    """Return the fault in a message Fault.

    Raises:
        ParameterError: An unknown channel, type or parameter, or a value that is not admitted.
    """
    from hsv.faults.table import Fault  # of most nodes, none needs it

    names, values = message.parameter_names, message.parameter_values
    if len(names) != len(values):
        raise ParameterError(f"fault.parameter_values: {len(values)} values, expected one a name, {len(names)}")
    return Fault.of(message.channel, message.type, dict(zip(names, map(float, values), strict=True)))


def active_faults(message: Message) -> tuple[ActiveFault, ...]:
    """Return the faults in a message Actuator, with their first steps.

    Raises:
        ParameterError: See :func:`fault_in`.
    """
    from hsv.faults.schedule import ActiveFault

    return tuple(
        ActiveFault(fault_in(fault), int(since)) for fault, since in zip(message.active, message.since, strict=True)
    )


def _fill_actuator(signals: Signals, actuator: Message, message_class: MessageClass) -> None:
    _answer(signals, actuator)
    fill_input(actuator, signals.actuator)
    fault = message_class("hsv_msgs/msg/Fault")
    actuator.active = [
        fault(
            channel=acting.channel,
            type=acting.type,
            parameter_names=list(acting.parameters),
            parameter_values=np.array([*acting.parameters.values()]),
        )
        for acting, _ in signals.active_faults
    ]
    actuator.since = np.array([since for _, since in signals.active_faults], np.uint64)


FILL: dict[str, Callable[[Signals, Message, MessageClass], None]] = {
    CLOCK: _fill_clock,
    MEASUREMENT: _fill_measurement,
    STATE: _fill_vehicle_state,
    FORCES: _fill_forces,
    FILTERED_STATE: _fill_filtered_state,
    NOMINAL: _fill_nominal,
    COMMAND: _fill_command,
    TUBE_STATUS: _fill_tube_status,
    ACTUATOR: _fill_actuator,
}
"""Functions by topic, from the signals to its message."""

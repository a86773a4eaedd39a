"""The closed loop as a table of blocks: their inputs, outputs and order in a period.

Stepwise flight, nodes, replay, recorder and parameter pages use this table. The compiled loop of
:mod:`hsv.flight.closed_loop` has the same order; tests compare the two to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput, ControllerResult
from hsv.model import signals as types
from hsv.model.signals import N_INPUTS, PITCH_RATE, SignalType

if TYPE_CHECKING:  # a node imports only its own component
    from hsv.control.design import ControlDesign
    from hsv.control.nominal_trajectory import NominalTrajectory
    from hsv.control.notch_filter import NotchFilter
    from hsv.flight.closed_loop import Components
    from hsv.model.faults.injector import FaultInjector
    from hsv.model.faults.schedule import ActiveFault
    from hsv.model.plant import Plant


class Signals:
    """Signals between the blocks in a step, SI; each block writes its outputs.

    The attributes except step, period and stamp are the signals of :mod:`hsv.model.signals`.
    """

    step = -1
    """Step k; -1 before the first step"""
    period: float
    """Control period T, s"""
    stamp: tuple[int, int] = (0, 0)
    """Simulated time in the messages of the step: seconds and nanoseconds"""

    state: np.ndarray
    """True state x (9)"""
    status = 0
    """:class:`hsv.model.plant.FlightStatus` of the state"""
    forces: tuple[float, float, float, float, float]
    """Lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa"""
    effector: np.ndarray
    """Positions of the effectors (2)"""
    air: np.ndarray
    """Forward and upward wind (m/s) and relative density (3) over the previous period"""
    measurement: np.ndarray
    """Measured state (9)"""

    estimate: np.ndarray
    """State for feedback (9): the measurement, or the estimate if an estimator is enabled"""
    filtered_pitch_rate: float
    """q_f, rad/s"""
    filter_state: np.ndarray
    """State s (2 sections) of the notch filter before its update"""

    reference: np.ndarray
    """x_r (9)"""
    reference_input: np.ndarray
    """u_r (2)"""
    deviation: np.ndarray
    """x_n (9)"""
    nominal_input: np.ndarray
    """u_n (2)"""
    gain: np.ndarray
    """K (2, 9) if it was computed in flight, else empty"""
    gain_index: int
    """Index of the nested gain, 0 for the outermost ellipsoid"""
    nominal_status: int
    """:class:`hsv.control.nominal_law.NominalStatus`"""

    command: np.ndarray = np.zeros(N_INPUTS)
    """Input u (2); until the controller has been stepped, that of the previous step (zero before step 0)"""
    saturated: np.ndarray
    """Mask (2) of the inputs changed by the limits"""
    diagnostics: ControllerResult
    """Complete result of the controller"""
    actuator: np.ndarray
    """Input of the actuators (2): the command after link and faults"""
    active_faults: tuple[ActiveFault, ...]
    """Active faults of the step"""


@dataclass(frozen=True)
class Block:
    """A block of the closed loop, stepped once per period."""

    name: str
    built_by: str
    """Function that builds the component from flat parameters, as ``module:name``; it is imported on first use."""
    inputs: tuple[SignalType, ...]
    """Inputs of the same step, with direct feedthrough to the outputs."""
    outputs: tuple[SignalType, ...]
    step: Callable[[Any, Signals], None]
    """Function that steps the component on the signals."""
    delayed: tuple[SignalType, ...] = ()
    """Inputs of the previous step."""
    state: tuple[SignalType, ...] = ()
    """Signals that the component keeps for the next step."""
    designed: bool = False
    """Whether the component is built from a control design."""

    def build(self, values: Mapping[str, Any], design: ControlDesign | None = None) -> Any:
        """Build the component.

        Args:
            values: Flat parameters.
            design: The design in ``values``, if it is known already.
        """
        module, _, path = self.built_by.partition(":")
        build = attrgetter(path)(import_module(module))
        return build(values, design) if self.designed else build(values)


def _fly(plant: Plant, signals: Signals) -> None:
    if signals.step < 0:
        result = plant.reset()
    else:
        plant.place(signals.step, signals.state)
        result = plant.step(signals.actuator, signals.active_faults)
    signals.step, signals.period = result.step, plant.period
    signals.state, signals.forces, signals.status = result.state, result.forces, result.status
    signals.effector, signals.air = result.effector, result.air
    signals.measurement = result.measurement


def _filter(notch: NotchFilter, signals: Signals) -> None:
    measured, estimator = signals.measurement, notch.estimator
    signals.estimate = measured if estimator is None else estimator.step(signals.step, measured, signals.command)
    result = notch.step(float(signals.estimate[PITCH_RATE]))
    signals.filtered_pitch_rate, signals.filter_state = result.filtered_pitch_rate, result.filter_state


def _plan(trajectory: NominalTrajectory, signals: Signals) -> None:
    result = trajectory.step(signals.measurement)
    signals.reference, signals.reference_input = result.reference, result.reference_input
    signals.deviation, signals.nominal_input = result.deviation, result.input
    signals.gain = _NO_GAIN if result.in_family else result.gain
    signals.gain_index, signals.nominal_status = result.gain_index, result.status


def _control(controller: Controller, signals: Signals) -> None:
    result = controller.step(ControllerInput(signals.step, *_controller_inputs(signals)))
    signals.command, signals.saturated, signals.diagnostics = result.input, result.saturated, result


def _actuate(injector: FaultInjector, signals: Signals) -> None:
    result = injector.step(signals.step, signals.command)
    signals.actuator, signals.active_faults = result.actuator, result.active


_NO_GAIN = np.empty((0, 9))
_controller_inputs = attrgetter(*(signal.name for signal in CONTROLLER_INPUTS))

VEHICLE = Block(
    "plant",
    "hsv.model.plant:Plant.from_parameters",
    inputs=(),
    outputs=(types.MEASUREMENT, types.STATE, types.STATUS, types.FORCES, types.EFFECTOR, types.AIR),
    step=_fly,
    delayed=(types.ACTUATOR, types.ACTIVE_FAULTS),
    state=(types.STATE,),
)
NOTCH_FILTER = Block(
    "notch_filter",
    "hsv.control.notch_filter:NotchFilter.from_parameters",
    inputs=(types.MEASUREMENT,),
    outputs=(types.ESTIMATE, types.FILTERED_PITCH_RATE, types.FILTER_STATE),
    step=_filter,
    delayed=(types.COMMAND,),  # input of the estimator; without one the node does not subscribe to it
    state=(types.FILTER_STATE,),
)
NOMINAL_TRAJECTORY = Block(
    "nominal_trajectory",
    "hsv.control.nominal_trajectory:NominalTrajectory.from_parameters",
    inputs=(types.MEASUREMENT,),
    outputs=(
        types.REFERENCE,
        types.REFERENCE_INPUT,
        types.DEVIATION,
        types.NOMINAL_INPUT,
        types.GAIN,
        types.GAIN_INDEX,
        types.NOMINAL_STATUS,
    ),
    step=_plan,
    state=(types.DEVIATION,),
    designed=True,
)
CONTROLLER = Block(
    "controller",
    "hsv.control.controllers:build_controller",
    inputs=CONTROLLER_INPUTS,
    outputs=(types.COMMAND, types.SATURATED, types.DIAGNOSTICS),
    step=_control,
    designed=True,
)
FAULT_INJECTOR = Block(
    "fault_injector",
    "hsv.model.faults.injector:FaultInjector.from_parameters",
    inputs=(types.COMMAND,),
    outputs=(types.ACTUATOR, types.ACTIVE_FAULTS),
    step=_actuate,
)


LOOP = (VEHICLE, NOTCH_FILTER, NOMINAL_TRAJECTORY, CONTROLLER, FAULT_INJECTOR)
"""The blocks of the closed loop in the order of a step: each follows the sources of its inputs."""


def steps(components: Components) -> Iterator[Signals]:
    """Simulate ``components`` from the start and yield the signals of every step; the object is the same each time."""
    signals = Signals()
    for block in LOOP:
        getattr(components, block.name).reset()
    while signals.status == 0:
        for block in LOOP:
            block.step(getattr(components, block.name), signals)
        yield signals

"""The closed loop as a table of blocks: their inputs, outputs and order in a period.

Stepwise flight, nodes, replay, recorder and parameter pages use this table. The compiled loop of
:mod:`hsv.flight.closed_loop` has the same order; tests compare the two bit by bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput
from hsv.model import signals as types
from hsv.model.signals import N_INPUTS, PITCH_RATE, SignalType

if TYPE_CHECKING:  # at run time, a node imports only its own component
    from hsv.control.design import ControlDesign
    from hsv.control.nominal_trajectory import NominalTrajectory
    from hsv.control.notch_filter import NotchFilter
    from hsv.flight.closed_loop import Components
    from hsv.model.faults.injector import FaultInjector
    from hsv.model.plant import Plant


class Signals(SimpleNamespace):
    """Signals between the blocks in a step, SI, by their names in :mod:`hsv.model.signals`.

    Each block writes its outputs. The other attributes are the step, the control period (s), and the simulated time.
    """

    step = -1
    """Step k; -1 before the first step"""
    stamp = 0, 0
    """Simulated time in the messages of the step: seconds and nanoseconds"""
    status = 0
    """:class:`hsv.model.plant.FlightStatus` of the state"""
    command = np.zeros(N_INPUTS)
    """Command u (2); until the controller is stepped, the command of the previous step, or zero before step 0"""


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
    """Function that steps a component: it reads its inputs from the signals and writes its outputs to them."""
    delayed: tuple[SignalType, ...] = ()
    """Inputs of the previous step."""
    state: tuple[SignalType, ...] = ()
    """Signals that the component keeps for the next step."""
    designed: bool = False
    """Whether the component is built from a control design."""

    def build(self, values: Mapping[str, Any], design: ControlDesign | None) -> Any:
        """Return the component for the flat parameters ``values`` of a flight and its ``design``, if it has one."""
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
    delayed=(types.COMMAND,),  # for the estimator; a node without an estimator does not subscribe to it
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
    "hsv.plugins.controllers:build_controller",
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
    """Simulate ``components`` until the flight ends; yield the signals after every step, always in the same object."""
    signals = Signals()
    for block in LOOP:
        getattr(components, block.name).reset()
    while signals.status == 0:
        for block in LOOP:
            block.step(getattr(components, block.name), signals)
        yield signals

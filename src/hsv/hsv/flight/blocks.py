"""The loop as a table: which blocks are stepped in a period, in which order, what each takes and gives.

Stepwise flight, nodes, replay, recorder, parameter pages and cache warming read it; the compiled loop of
:mod:`hsv.flight.closed_loop` has the same order, which the tests of bit-equality guard.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from hsv.base.errors import HsvError
from hsv.control.controller import CONTROLLER_INPUTS, Controller, ControllerInput, ControllerResult
from hsv.control.controllers import build_controller
from hsv.model import signals as types
from hsv.model.signals import N_INPUTS, PITCH_RATE, SignalType

if TYPE_CHECKING:  # a node imports its own component alone
    from hsv.base.parameters import Parameter
    from hsv.control.design import ControlDesign
    from hsv.control.nominal_trajectory import NominalTrajectory
    from hsv.control.notch_filter import NotchFilter
    from hsv.flight.closed_loop import Components
    from hsv.model.faults.injector import FaultInjector
    from hsv.model.faults.schedule import ActiveFault
    from hsv.model.plant import Plant


class Signals:
    """Signals between the blocks in a step, SI units and radians; each block writes its outputs.

    The attributes other than step, period and stamp are the signals of :mod:`hsv.model.signals`, by name.
    """

    step = -1
    """k; -1 before the vehicle has said where it starts"""
    period: float
    """T, s"""
    stamp: tuple[int, int] = (0, 0)
    """Seconds and nanoseconds of simulated time in the messages of the step, if there are any"""

    state: np.ndarray
    """x (9), the truth"""
    status = 0
    """:class:`hsv.model.plant.FlightStatus` of the state"""
    forces: tuple[float, float, float, float, float]
    """Lift N, drag N, thrust N, pitching moment N m, dynamic pressure Pa"""
    effector: np.ndarray
    """(2), where the effectors are"""
    air: np.ndarray
    """Wind forward and up (m/s), and the density for that of the model (3), over the period before"""
    measurement: np.ndarray
    """x (9) as measured"""

    estimate: np.ndarray
    """x (9) as the controller is to take it: the measurement, or what an estimator makes of it"""
    filtered_pitch_rate: float
    """q_f, rad/s"""
    filter_state: np.ndarray
    """s (2 s) before its update"""

    reference: np.ndarray
    """x_r (9)"""
    reference_input: np.ndarray
    """u_r (2)"""
    deviation: np.ndarray
    """x_n (9)"""
    nominal_input: np.ndarray
    """u_n (2)"""
    gain: np.ndarray
    """K (2, 9) if it was found in flight, else empty"""
    gain_index: int
    """Index of the nested gain, 0 for the outermost ellipsoid."""
    nominal_status: int
    """:class:`hsv.control.nominal_law.NominalStatus`"""

    command: np.ndarray = np.zeros(N_INPUTS)
    """u (2); that of the step before until the controller has said it, of which step 0 has none"""
    saturated: np.ndarray
    """(2) whether the limits have changed it"""
    diagnostics: ControllerResult
    """Output of the controller besides its input."""
    actuator: np.ndarray
    """(2), what becomes of the command"""
    active_faults: tuple[ActiveFault, ...]
    """Faults of this step."""


@dataclass(frozen=True)
class Block:
    """Interface of what is stepped once per period."""

    name: str
    component: str
    """Class, ``module:Class``, with PARAMETERS, ``from_parameters`` and ``reset``, imported when it is needed; empty if
    the parameters choose it."""
    inputs: tuple[SignalType, ...]
    """Signals of the same step that it needs: what it gives feeds through from them."""
    outputs: tuple[SignalType, ...]
    step: Callable[[Any, Signals], None]
    """Steps a component on the signals."""
    delayed: tuple[SignalType, ...] = ()
    """Signals of the step before that it needs."""
    state: tuple[SignalType, ...] = ()
    """Signals that it keeps for the next step."""
    designed: bool = False
    """Whether it is built from the controller's design, too."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters of its own, beside those of the design."""
        return tuple(self._class().PARAMETERS)

    def build(self, values: Mapping[str, Any], design: ControlDesign | None = None) -> Any:
        """Return the component that the flat parameters ``values`` describe.

        ``design``: the one in ``values``, where it is known already.

        Raises:
            ParameterError, DesignError, TrimError: A wrong value, named.
        """
        build = self._class().from_parameters
        return build(values, design) if self.designed else build(values)

    def _class(self) -> Any:
        module, _, name = self.component.partition(":")
        return getattr(import_module(module), name)


@dataclass(frozen=True)
class ControllerBlock(Block):
    """The block whose component the parameters choose."""

    def build(self, values: Mapping[str, Any], design: ControlDesign | None = None) -> Controller:
        """Return the controller that ``values`` name."""
        return build_controller(values, design)


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
    result = controller.step(ControllerInput(signals.step, *_given(signals)))
    signals.command, signals.saturated, signals.diagnostics = result.input, result.saturated, result


def _actuate(injector: FaultInjector, signals: Signals) -> None:
    result = injector.step(signals.step, signals.command)
    signals.actuator, signals.active_faults = result.actuator, result.active


_NO_GAIN = np.empty((0, 9))
_given = attrgetter(*(signal.name for signal in CONTROLLER_INPUTS))

VEHICLE = Block(
    "plant",
    "hsv.model.plant:Plant",
    inputs=(),
    outputs=(types.MEASUREMENT, types.STATE, types.STATUS, types.FORCES, types.EFFECTOR, types.AIR),
    step=_fly,
    delayed=(types.ACTUATOR, types.ACTIVE_FAULTS),
    state=(types.STATE,),
)
NOTCH_FILTER = Block(
    "notch_filter",
    "hsv.control.notch_filter:NotchFilter",
    inputs=(types.MEASUREMENT,),
    outputs=(types.ESTIMATE, types.FILTERED_PITCH_RATE, types.FILTER_STATE),
    step=_filter,
    delayed=(types.COMMAND,),  # of the estimator, where one flies: the nodes hear it there alone
    state=(types.FILTER_STATE,),
)
NOMINAL_TRAJECTORY = Block(
    "nominal_trajectory",
    "hsv.control.nominal_trajectory:NominalTrajectory",
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
CONTROLLER = ControllerBlock(
    "controller",
    "",
    inputs=CONTROLLER_INPUTS,
    outputs=(types.COMMAND, types.SATURATED, types.DIAGNOSTICS),
    step=_control,
)
FAULT_INJECTOR = Block(
    "fault_injector",
    "hsv.model.faults.injector:FaultInjector",
    inputs=(types.COMMAND,),
    outputs=(types.ACTUATOR, types.ACTIVE_FAULTS),
    step=_actuate,
)


def in_order(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """Return ``blocks`` in an order in which each finds the inputs that it needs.

    Raises:
        HsvError: A signal that nobody or that two give, or that is taken with another unit or size than it is given
            with, or an algebraic loop.
    """
    givers: dict[str, tuple[Block, SignalType]] = {}
    for block in blocks:
        for signal in block.outputs:
            if signal.name in givers:
                other = givers[signal.name][0].name
                raise HsvError(f"{block.name}: gives {signal.name}, expected no other block to, {other} does")
            givers[signal.name] = block, signal
    for block in blocks:
        for signal in (*block.inputs, *block.delayed):
            if signal.name not in givers:
                raise HsvError(f"{block.name}: needs {signal.name}, expected one of {', '.join(givers)}")
            giver, given = givers[signal.name]
            if signal != given:
                wanted, found = (f"{s.size} in {s.unit!r}" for s in (signal, given))
                raise HsvError(f"{block.name}: needs {signal.name}, {wanted}, expected {found} as {giver.name} gives")
    ordered: list[Block] = []

    def place(block: Block, path: tuple[Block, ...]) -> None:
        if block in path:
            names = " -> ".join(b.name for b in (*path[path.index(block) :], block))
            raise HsvError(
                f"algebraic loop {names}: expected a block in it that needs a signal of the step before only"
            )
        if block not in ordered:
            for signal in block.inputs:
                place(givers[signal.name][0], (*path, block))
            ordered.append(block)

    for block in blocks:
        place(block, ())
    return tuple(ordered)


LOOP = in_order((VEHICLE, NOTCH_FILTER, NOMINAL_TRAJECTORY, CONTROLLER, FAULT_INJECTOR))
"""The blocks, in the order in which a step passes through them."""


def steps(components: Components) -> Iterator[Signals]:
    """Fly ``components`` from the beginning, step by step; yield the signals of every step, the same object each time.

    Raises:
        RunError: A controller of one's own failed.
    """
    signals = Signals()
    for block in LOOP:
        getattr(components, block.name).reset()
    while signals.status == 0:
        for block in LOOP:
            block.step(getattr(components, block.name), signals)
        yield signals

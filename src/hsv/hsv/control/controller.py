"""Interface of a controller: its inputs and outputs in a step.

A custom controller is a class with four attributes, for example::

    class Open:
        PARAMETERS = (Parameter("open.trim_share", 1.0, "times the input of the trim", "", 0.0, 2.0),)

        @classmethod
        def from_parameters(cls, values, design):
            controller = cls()
            controller.share = validate(cls.PARAMETERS, values)["open.trim_share"]
            return controller

        def reset(self):
            pass

        def step(self, inputs):
            return self.share * inputs.reference_input
"""

from __future__ import annotations

import copy
import ctypes
import traceback
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from hsv.base.errors import ControllerError, ParameterError, RunError
from hsv.base.parameters import Parameter
from hsv.core import doubles, ffi, lib
from hsv.model import signals
from hsv.model.dynamics import VehicleParameters
from hsv.model.signals import INPUT_NAMES, N_INPUTS

if TYPE_CHECKING:
    from hsv.control.design import ControlDesign


SHIPPED_CONTROLLERS = {"tube_mpc": "hsv.control.tube_law:TubeLaw", "robust_mpc": "hsv.control.robust_mpc:RobustMpc"}
"""Classes of this library by name; others are entry points, see :mod:`hsv.plugins.controllers`."""

_DEFAULT = "tube_mpc"

NODE = "node:"
"""Prefix of the name of a controller that is a separate ROS 2 node, ``node:package/executable``; the prefix alone means
a node that is started by hand."""

CONTROLLER_PARAMETERS = (
    Parameter(
        "controller",
        _DEFAULT,
        "controller: a registered name, package.module:Class, path/lib.so:symbol, path/name.fmu or "
        "node:package/executable",
    ),
)

FOREIGN_FAILURES = (Exception, SystemExit)
"""Exceptions to expect from external code, which may raise anything and even call ``sys.exit``."""

STEP_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64, *[ctypes.c_void_p] * 4)
"""``int32_t step(int64_t k, const double *in, double *out, double *state, const double *par)``."""


class ControllerInput(NamedTuple):
    """Inputs of a controller in a step, in SI units: k, and the signals of :data:`CONTROLLER_INPUTS`."""

    step: int
    """Number k of the step, from 0; time t = k T"""
    estimate: np.ndarray
    """State x (9) with the unfiltered pitch rate: the estimate if there is an estimator, else the measurement"""
    filtered_pitch_rate: float
    """Pitch rate q_f behind the notch filter, rad/s"""
    reference: np.ndarray
    """Reference state x_r (9)"""
    reference_input: np.ndarray
    """Reference input u_r (2)"""
    deviation: np.ndarray
    """Nominal state x_n (9), a deviation from the reference"""
    nominal_input: np.ndarray
    """Nominal input u_n (2), a deviation from the reference input"""
    filter_state: np.ndarray
    """States (2 per section) of the notch filter before its update; empty without a notch filter"""


CONTROLLER_INPUTS = tuple(signals.SIGNALS[name] for name in ControllerInput._fields[1:])
"""Inputs in the order in which a compiled controller receives them, see ``hsv_block.h``."""

CONTROLLER_OUTPUTS = (signals.UNSATURATED_INPUT,)
"""Outputs of a compiled controller, before the bench limits them."""


@dataclass(frozen=True)
class ControllerResult:
    """Result of a controller's step; :class:`hsv.control.tube_law.TubeResult` adds diagnostics."""

    input: np.ndarray
    """Input u (2), within the limits"""
    u_unsaturated: np.ndarray
    """Input (2) before the limits"""

    @property
    def saturated(self) -> np.ndarray:
        """Whether the limits changed each input, shape (2,)."""
        return np.asarray(self.input != self.u_unsaturated)


class StepKernel(NamedTuple):
    """The address of a compiled step function, and its arrays.

    The signature is ``int32 step(int64 k, const double *in, double *out, double *state, const double *par)``; a result
    other than 0 ends the flight. ``in`` holds :data:`CONTROLLER_INPUTS` one after the other, ``out`` receives the
    unsaturated input (2), ``state`` holds everything that is kept from step to step, and ``par`` is ``parameters``.
    """

    address: int
    state: np.ndarray
    """State before step 0; every flight uses a copy."""
    parameters: np.ndarray


class Controller(ABC):
    """A controller in the loop: it computes the input of a step from measured, reference and nominal state."""

    name = ""
    """Name in error messages."""
    in_core = False
    """Whether the C core contains this control law; ``kernel`` is then its data"""
    kernel: Any = None
    """The :class:`StepKernel` of a controller outside the core; None: call :meth:`unsaturated_input`"""
    library: Any = None
    """The process that steps a controller in a shared library, see :mod:`hsv.plugins.library_process`, or None"""

    @abstractmethod
    def reset(self) -> None:
        """Clear the state of the controller before a new flight."""

    @abstractmethod
    def step(self, inputs: ControllerInput) -> ControllerResult:
        """Return the input of this step, limited and unlimited; called once per step, in order."""

    def unsaturated_input(self, inputs: ControllerInput) -> tuple[float, float]:
        """Return fuel equivalence ratio and elevator (rad) before the limits; the C loop calls it, not :meth:`step`."""
        fuel, elevator = self.step(inputs).u_unsaturated
        return float(fuel), float(elevator)

    not_copied = ""
    """Why the controller cannot be copied, as it declares itself; empty: it can"""

    def copied(self) -> Controller:
        """Return a separate controller that continues from the state of this one."""
        return copy.deepcopy(self)

    def failure(self, step: int, what: str) -> ControllerError:
        """Return the error for an invalid output in ``step``; ``what`` describes the output."""
        expected = f"expected {len(INPUT_NAMES)} finite numbers: {' and '.join(INPUT_NAMES)}"
        return ControllerError(f"{self.name}, step {step}: {what}, {expected}")


class ControllerClass(Protocol):
    """The class of a controller: its parameters and its constructor.

    An instance has either a ``kernel``, a :class:`StepKernel`, or the methods ``reset`` and ``step``. A step returns
    the unsaturated input, fuel equivalence ratio and elevator deflection (rad); the bench limits it. An instance of
    :class:`Controller` needs no wrapper and is called directly.
    """

    PARAMETERS: tuple[Parameter, ...]
    """Parameters of the controller, named ``table.parameter``; a scenario sets them in the table of that name."""

    def from_parameters(self, values: Mapping[str, Any], design: ControlDesign | None) -> Any:
        """Return a controller for a flight with the flat parameters ``values``; ``design`` is None if it has no design.

        ``values`` lacks :data:`hsv.plugins.controllers.HIDDEN_PARAMETERS` unless the controller is a shipped one.
        """


class NodeController(Controller):
    """Placeholder for a controller that is a separate ROS 2 node; stepping it here raises a ParameterError."""

    def __init__(self, name: str) -> None:
        """Take the ``name`` for error messages."""
        self.name = name

    @property
    def kernel(self) -> Any:
        """Raise the error that :meth:`refusal` returns."""
        raise self.refusal()

    def reset(self) -> None:
        """Do nothing."""

    def step(self, inputs: ControllerInput) -> ControllerResult:
        """Raise the error that :meth:`refusal` returns."""
        raise self.refusal()

    def refusal(self) -> ParameterError:
        """Return the error for an attempt to step this controller outside its node."""
        return ParameterError(f"controller = {self.name!r}: a node of its own, expected hsv run to fly it")


_FAR = 10.0
"""Multiple of the input range beyond which a first command is taken for one in degrees."""


class ExternalController(Controller):
    """A custom controller, in Python or compiled, whose outputs are checked and limited."""

    def __init__(self, name: str, controller: Any, vehicle: VehicleParameters) -> None:
        """Take a ``controller``, its ``name`` for error messages, and the ``vehicle`` with the input limits."""
        self.name = name
        self.vehicle = vehicle
        self._minimum, self._maximum = vehicle.input_minimum, vehicle.input_maximum
        self._controller = controller
        self.kernel = getattr(controller, "kernel", None)
        if self.kernel is not None:
            self.reset()

    def reset(self) -> None:
        """Clear the state of the controller before a new flight.

        Raises:
            ControllerError: The controller failed.
        """
        if self.kernel is not None:
            self._state = self.kernel.state.copy()
            return
        try:
            self._controller.reset()
        except FOREIGN_FAILURES as error:
            raise ControllerError(f"{self.name}, reset: {failure_words(error)}") from error

    def copied(self) -> ExternalController:
        """Return a separate controller that continues from the state of this one."""
        if self.kernel is None:
            return copy.deepcopy(self)
        made = copy.copy(self)
        made._state = self._state.copy()
        return made

    def unsaturated_input(self, inputs: ControllerInput) -> tuple[float, float]:
        """Return fuel equivalence ratio and elevator (rad) before the limits; they may be infinite or NaN.

        Raises:
            ControllerError: The controller failed, or did not return two numbers.
        """
        try:
            given = self._call(inputs)
        except ControllerError:
            raise
        except FOREIGN_FAILURES as error:
            words = failure_words(error)
            if not isinstance(error, RunError):
                frames = traceback.extract_tb(error.__traceback__)
                own = next(frame for frame in reversed(frames) if "site-packages" not in frame.filename)
                words += f" ({Path(own.filename).name}:{own.lineno})"
            raise ControllerError(f"{self.name}, step {inputs.step}: {words}") from error
        try:
            if np.iscomplexobj(given):  # numpy would discard the imaginary part
                raise TypeError
            fuel, elevator = given
            return float(fuel), float(elevator)
        except (TypeError, ValueError, OverflowError):
            raise self.failure(inputs.step, f"answered {' '.join(repr(given).split())[:80]}") from None

    def step(self, inputs: ControllerInput) -> ControllerResult:
        """Return the input of this step, limited and unlimited.

        Raises:
            ControllerError: The controller failed, or did not return two finite numbers.
        """
        unsaturated = np.array(self.unsaturated_input(inputs))
        if not np.all(np.isfinite(unsaturated)):
            raise self.failure(inputs.step, f"answered {unsaturated.tolist()}")
        return ControllerResult(np.clip(unsaturated, self._minimum, self._maximum), unsaturated)

    def doubt(self, first: np.ndarray) -> str:
        """Return a warning if the elevator of the ``first`` input (2), before the limits, is far beyond its range."""
        largest = max(-self._minimum[1], self._maximum[1])
        if not abs(first[1]) > _FAR * largest:
            return ""
        return f"{self.name}: first elevator deflection {first[1]:.3g} rad, the limit is {largest:.3g} rad: in degrees?"

    def _call(self, inputs: ControllerInput) -> Any:
        if self.kernel is None:
            return self._controller.step(inputs)
        return call_step_function(
            self.kernel.address, inputs.step, flat_input(inputs), self._state, self.kernel.parameters
        )


def failure_words(error: BaseException) -> str:
    """Return type and message of an exception of external code, on one line."""
    return " ".join(f"{type(error).__name__}: {error}".split()).removesuffix(":")


def flat_input(inputs: ControllerInput) -> np.ndarray:
    """Return the inputs of a compiled controller as one array, in the order of :data:`CONTROLLER_INPUTS`."""
    return np.concatenate([np.ravel(given) for given in inputs[1:]])


def call_step_function(
    address: int, step: int, given: np.ndarray, state: np.ndarray, parameters: np.ndarray
) -> np.ndarray:
    """Call the step function at an ``address`` and return the unsaturated input (2); ``state`` changes in place.

    ``given`` are the inputs of the controller as :func:`flat_input` arranges them.

    Raises:
        RunError: The function returned a value other than 0, or wrote behind its state or outputs.
    """
    out, own = np.empty(N_INPUTS), guarded(state)
    call = ffi.new("hsv_call *", [ffi.cast("hsv_step_function", address), doubles(own), doubles(parameters)])
    code = lib.hsv_call_step(call, step, doubles(given), doubles(out))
    if wrong := overwritten(code, own):
        raise RunError(wrong)
    state[:] = own[: len(state)]
    if code:
        raise RunError(f"returned {code}")
    return out


def guarded(state: np.ndarray) -> np.ndarray:
    """Return a copy of the ``state`` of a step function with guard words behind it."""
    room = np.empty(len(state) + lib.GUARDS)
    room[: len(state)] = state
    lib.hsv_set_guards(doubles(room[len(state) :]))
    return room


def overwritten(code: int, state: np.ndarray) -> str:
    """Return what a step function with the result ``code`` wrote to that is not its own; empty if nothing is found.

    ``state`` has guard words, see :func:`guarded`.
    """
    if not lib.hsv_intact(doubles(state[-lib.GUARDS :])):
        return f"wrote behind the end of its state, expected at most {len(state) - lib.GUARDS} numbers there"
    if code == lib.OVERRUN:
        return f"wrote behind the end of its outputs, expected {N_INPUTS} numbers"
    return ""

"""Controllers in FMUs: ``controller = "path/controller.fmu"``, FMI 2.0 or 3.0 for co-simulation.

A child process loads the FMU with FMPy and steps it like a block of ``hsv_block.h``, see
:mod:`hsv.plugins.library_process`. Step k sets the inputs, advances the FMU from k T to (k + 1) T and reads the
outputs, which are u(k).

Variables of the FMU are matched to signals by name, such as ``measurement.altitude``; the scenario's table ``[fmu]``
contains the names that differ.
"""

from __future__ import annotations

import copy
import re
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from ctypes import byref, c_double, c_void_p, cast
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import ParameterError, QuantityError, RunError
from hsv.base.parameters import Parameter, validate
from hsv.base.units import parse_quantity
from hsv.control.controller import CONTROLLER_INPUTS, CONTROLLER_OUTPUTS, FOREIGN_FAILURES, STEP_FUNCTION, failure_words
from hsv.model.plant import PLANT_PARAMETERS
from hsv.model.signals import ESTIMATE, MEASUREMENT, SignalType, numbers_of
from hsv.model.vehicle import Vehicle
from hsv.plugins.library import LibraryClass, LibraryController
from hsv.plugins.library_answers import CBlock

_INPUTS = [
    number
    for signal in CONTROLLER_INPUTS[:-1]  # without the state of the notch filter, whose size varies
    for number in numbers_of(MEASUREMENT if signal == ESTIMATE else signal)
]
"""Name and unit of each number that an FMU can receive, in the order of the inputs of a compiled controller."""

_OUTPUTS = [number for signal in CONTROLLER_OUTPUTS for number in numbers_of(signal)]

_PARAMETERS = (
    *(Parameter(f"fmu.{name}", name, f"name of {name} in the FMU") for name, _ in (*_INPUTS, *_OUTPUTS)),
    Parameter("fmu.unconnected", [""], "inputs that keep their start values; * stands for any text"),
)

_FLOATS = ("Real", "Float64")


class FmuClass(LibraryClass):
    """Class-like object for a controller in an FMU, see :class:`hsv.control.controller.ControllerClass`."""

    def _check(self) -> None:
        self.PARAMETERS = _PARAMETERS

    def from_parameters(self, values: Mapping[str, Any], design: object) -> LibraryController:
        """Return the controller for a flight with the flat parameters ``values``; ``design`` is not used.

        Raises:
            ParameterError: A variable is missing, has another type or unit or stands for two inputs, or an input is
                neither a signal of the bench nor listed in ``fmu.unconnected``.
        """
        own = validate(_PARAMETERS, values)
        try:
            routes = self._routes(own)
        except ParameterError as error:
            raise ParameterError(f"controller = {self._name!r}: {error}") from error
        period = next(p for p in PLANT_PARAMETERS if p.name == "period")
        numbers = np.array([validate((period,), values)["period"], *routes], float)
        vehicle = Vehicle.from_parameters(values).decoupled
        return FmuController(self._name, self._path, self._symbol, self.block.state_size, numbers, vehicle)

    def _routes(self, own: Mapping[str, Any]) -> list[int]:
        """Return for each FMU input its index in ``_INPUTS``, or -1; then for each of ``_OUTPUTS``, the FMU's index."""
        sources = {own[f"fmu.{name}"]: (i, name, unit) for i, (name, unit) in enumerate(_INPUTS)}
        if len(sources) < len(_INPUTS):
            raise ParameterError("[fmu]: a name stands twice, expected a variable for each input")
        routes = []
        for signal in self.block.inputs:
            index, _, unit = sources.get(signal.name, (-1, "", ""))
            if index >= 0:
                _check_variable("input", signal, unit)
            elif not any(_matches(signal.name, pattern) for pattern in own["fmu.unconnected"]):
                raise ParameterError(
                    f"input {signal.name!r}: not a signal of the bench, such as measurement.altitude, expected its "
                    "name in the table [fmu], under the signal or in unconnected"
                )
            routes.append(index)
        inputs = [signal.name for signal in self.block.inputs]
        for variable, (_, name, _) in sources.items():
            if variable != name and variable not in inputs:
                raise ParameterError(f"fmu.{name} = {variable!r}: no such input, expected one of {', '.join(inputs)}")
        outputs = {signal.name: (i, signal) for i, signal in enumerate(self.block.outputs)}
        for name, unit in _OUTPUTS:
            variable = own[f"fmu.{name}"]
            if variable not in outputs:
                raise ParameterError(f"fmu.{name} = {variable!r}: no such output, expected one of {', '.join(outputs)}")
            index, signal = outputs[variable]
            _check_variable("output", signal, unit)
            routes.append(index)
        return routes


class FmuController(LibraryController):
    """A controller in an FMU; its state is the number of its copy, see :meth:`LoadedFmu.copied`."""

    @property
    def not_copied(self) -> str:  # type: ignore[override]
        """A reason if the FMU does not declare that its state can be got and set."""
        return "" if len(self._state) else "this FMU cannot be copied"

    def copied(self) -> LibraryController:
        """Return a separate controller that continues from the state of this one."""
        made = copy.deepcopy(self)
        made._state[0] = self.library.request("copied", int, self._state[0])
        return made


def _matches(name: str, pattern: str) -> bool:
    return re.fullmatch(re.escape(pattern).replace(r"\*", ".*"), name) is not None


def _check_variable(kind: str, variable: SignalType, unit: str) -> None:
    """Refuse a ``variable`` that is not a floating-point scalar in ``unit``; a variable without unit is accepted."""
    if variable.size != 1:
        raise ParameterError(f"{kind} {variable.name!r}: expected a scalar of the type Float64 or Real")
    try:
        same = variable.unit in ("", unit) or parse_quantity(f"1 {variable.unit}", unit, "") == 1.0
    except QuantityError:
        same = False
    if not same:
        raise ParameterError(f"{kind} {variable.name!r} in {variable.unit!r}, expected {unit!r}")


class LoadedFmu:
    """An FMU in this process, instantiated anew in every step 0."""

    def __init__(self, path: Path) -> None:
        """Load the FMU at ``path``.

        Raises:
            ParameterError: The FMU cannot be loaded.
        """
        self._logged = ""
        self._fmu: Any = None
        self._saved: dict[float, tuple[Any, int]] = {}
        self._next = 0
        try:
            self._load(path)
        except ModuleNotFoundError as error:
            raise ParameterError(f"{failure_words(error)}, expected hsv[fmi]: pip install './src/hsv[fmi]'") from error
        except ParameterError:
            raise
        except Exception as error:
            raise ParameterError(f"cannot be loaded ({self._words(error)}), expected an FMU") from error
        self.failure = ""
        """Reason of the last failure of a step; empty before the first"""
        self._function = STEP_FUNCTION(self._step)
        self.block = CBlock(
            self._description.modelName,
            "",
            cast(self._function, c_void_p).value or 0,
            int(self._description.coSimulation.canGetAndSetFMUstate),
            tuple(map(_signal, self._inputs)),
            tuple(map(_signal, self._outputs)),
            (),
        )

    def _load(self, path: Path) -> None:
        from fmpy import extract, fmi2, read_model_description
        from fmpy.fmi3 import FMU3Slave
        from fmpy.logging import addLoggerProxy

        found = read_model_description(str(path))
        kinds = {"2": fmi2.FMU2Slave, "3": FMU3Slave}
        self._version = found.fmiVersion[0]
        if self._version not in kinds or found.coSimulation is None:
            raise ParameterError(f"FMI {found.fmiVersion}, expected an FMU for co-simulation, FMI 2.0 or 3.0")
        self._description, self._kind = found, kinds[self._version]
        self._inputs = [v for v in found.modelVariables if v.causality == "input"]
        self._outputs = [v for v in found.modelVariables if v.causality == "output"]
        self._folder = extract(str(path), tempfile.mkdtemp())
        self._logger: dict[str, Any] = {"logMessage": self._log}
        if self._version == "2":
            callbacks = fmi2.fmi2CallbackFunctions.from_buffer_copy(fmi2.defaultCallbacks)
            callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._log)
            addLoggerProxy(byref(callbacks))
            self._logger = {"callbacks": callbacks}
        self._instantiate()  # so that an FMU that fails here is refused before the flight

    def _instantiate(self) -> None:
        if self._fmu:
            with suppress(Exception):
                for state, _ in self._saved.values():
                    self._fmu.freeFMUState(state)
                self._fmu.terminate()
            self._fmu.freeInstance()
        self._saved.clear()
        self._copy = 0.0
        """Number of the copy whose state the instance has"""
        self._fmu = self._kind(
            instanceName="controller",
            guid=self._description.guid,
            modelIdentifier=self._description.coSimulation.modelIdentifier,
            unzipDirectory=str(self._folder),
        )
        self._fmu.instantiate(**self._logger)

    def _log(self, *arguments: Any) -> None:
        """Keep the FMU's last message about a failure; it comes last among the arguments, after status and category."""
        if arguments[-3] > 0:
            self._logged = " ".join((arguments[-1] or b"").decode(errors="replace").split())

    def _words(self, error: BaseException) -> str:
        return ": ".join(filter(None, (failure_words(error), self._logged)))

    def copied(self, number: float) -> int:
        """Save the state of the copy ``number``, 0 for the original, as a new copy; return its number.

        Raises:
            RunError: The FMU failed.
        """
        try:
            self._continue(number)
            made = int(max((number, *self._saved))) + 1
            self._saved[made] = self._fmu.getFMUState(), self._next
        except FOREIGN_FAILURES as error:
            raise RunError(self._words(error)) from error
        return made

    def _continue(self, number: float) -> None:
        """Give the instance the state of the copy ``number``."""
        if number != self._copy:
            self._saved[self._copy] = self._fmu.getFMUState(), self._next
            state, self._next = self._saved.pop(number)
            self._fmu.setFMUState(state)
            self._fmu.freeFMUState(state)
            self._copy = number

    def _set(self, values: Mapping[int, float]) -> None:
        if values:
            set_values = self._fmu.setReal if self._version == "2" else self._fmu.setFloat64
            set_values([*values], [*values.values()])

    def _begin(self, values: Mapping[int, float]) -> None:
        self._instantiate()
        if self._version == "2":
            self._fmu.setupExperiment(startTime=0.0)
        self._fmu.enterInitializationMode()
        self._set(values)
        self._fmu.exitInitializationMode()
        self._next = 0

    def _step(self, k: int, given: int, out: int, state: int, par: int) -> int:
        """Step the FMU, as a step function of ``hsv_block.h``; ``par``: period (s), then :meth:`FmuClass._routes`."""
        self._logged = ""
        try:
            count = len(self._inputs)
            period, *routes = (c_double * (1 + count + len(_OUTPUTS))).from_address(par)
            numbers = (c_double * len(_INPUTS)).from_address(given)
            values = {
                variable.valueReference: numbers[int(route)]
                for variable, route in zip(self._inputs, routes[:count], strict=True)
                if route >= 0
            }
            if k == 0:
                self._begin(values)
            elif self.block.state_size:
                self._continue(c_double.from_address(state).value)
            if k != self._next:
                raise RunError(f"step {k} after {self._next - 1}, expected the steps of one flight in order")
            self._set(values)
            ended = self._fmu.doStep(currentCommunicationPoint=k * period, communicationStepSize=period)
            if ended and ended[1]:
                raise RunError("the FMU ended the simulation")
            wanted = [self._outputs[int(route)].valueReference for route in routes[count:]]
            read = self._fmu.getReal if self._version == "2" else self._fmu.getFloat64
            (c_double * len(_OUTPUTS)).from_address(out)[:] = read(wanted)
            self._next = k + 1
        except FOREIGN_FAILURES as error:
            self.failure = self._words(error)
            return 1
        return 0


def _signal(variable: Any) -> SignalType:
    declared = variable.declaredType
    unit = variable.unit or (declared and declared.unit) or ""
    return SignalType(variable.name, unit, 1 if variable.type in _FLOATS and not variable.dimensions else 0)

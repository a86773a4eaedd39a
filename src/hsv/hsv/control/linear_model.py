"""Linear models of the vehicle at a trim point, with names and units: coupled, decoupled, or with notch filter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hsv.base.errors import QuantityError, one_of
from hsv.base.units import UnitSystem, in_system, unit_in
from hsv.control.notch_filter import continuous, default_sections, series
from hsv.model.dynamics import MODELS, jacobian
from hsv.model.lpv.linearisation import Filter, Mode, as_modes, extended_jacobian, extended_state, modes
from hsv.model.signals import INPUT_NAMES, INPUT_UNITS, N_RIGID, N_STATES, STATE_NAMES, STATE_UNITS
from hsv.model.trim import trim_at
from hsv.model.vehicle import DEFAULT_VEHICLE, load_vehicle

EXTENDED = "ECM"
READINGS = ("physical", "printed")
FILTER_UNITS = ("rad", "rad s")

_INFINITE = 1e6
"""Magnitude (rad/s) from which a zero of the pencil is one at infinity."""


@dataclass(frozen=True)
class LinearModel:
    """Linear model dx/dt = A x + B u, y = C x + D u of the deviations from an operating point.

    All states are outputs: C is the identity, D is zero.
    """

    A: np.ndarray
    """State matrix (n, n)"""
    B: np.ndarray
    """Input matrix (n, 2)"""
    C: np.ndarray
    """Output matrix (n, n)"""
    D: np.ndarray
    """Feedthrough matrix (n, 2)"""
    states: Mapping[str, str]
    """Units of the states, which are also the outputs, by name"""
    inputs: Mapping[str, str]
    """Units of the inputs by name"""
    operating_state: np.ndarray
    """State (n) at the operating point"""
    operating_input: np.ndarray
    """Input (2) at the operating point"""
    vehicle: str
    """Name or file of the vehicle"""
    coupling: str
    """Set of inertial coupling, or multiple of the derived set"""
    model: str
    """Coupled (CM), decoupled (DM), or extended by the notch filter (ECM)"""
    reading: str = ""
    """Pitch rate in eq. 40 of an ECM: physical or printed; empty for other models"""

    @property
    def poles(self) -> list[Mode]:
        """The modes of A, one for each pair of complex poles, highest natural frequency first."""
        return modes(self.A)

    @property
    def zeros(self) -> list[Mode]:
        """The transmission zeros from both inputs to altitude and velocity, in the form of :attr:`poles`."""
        from scipy.linalg import eigvals  # slow

        n = len(self.A)
        pencil = np.block([[self.A, self.B], [self.C[:2], self.D[:2]]])
        over, under = eigvals(pencil, np.diag([1.0] * n + [0.0] * len(self.B.T)), homogeneous_eigvals=True)
        finite = np.abs(over) < _INFINITE * np.abs(under)
        return as_modes(over[finite] / under[finite])

    def in_units(self, system: UnitSystem) -> LinearModel:
        """Return this model, which must be in SI units, with its signals in the units of ``system``."""
        state, inputs = (
            np.array([in_system(1.0, unit, system)[0] for unit in units.values()])
            for units in (self.states, self.inputs)
        )
        return replace(
            self,
            A=self.A * state[:, None] / state,
            B=self.B * state[:, None] / inputs,
            D=self.D * state[:, None] / inputs,
            states={name: unit_in(system, unit) for name, unit in self.states.items()},
            inputs={name: unit_in(system, unit) for name, unit in self.inputs.items()},
            operating_state=self.operating_state * state,
            operating_input=self.operating_input * inputs,
        )

    def as_dict(self) -> dict[str, Any]:
        """Return matrices, signal names, units and operating point as a dictionary, for files."""
        states, inputs = (
            {kind: list(units), f"{kind[:-1]}_units": list(units.values())}
            for kind, units in (("states", self.states), ("inputs", self.inputs))
        )
        outputs = {"outputs": states["states"], "output_units": states["state_units"]}
        return vars(self) | states | inputs | outputs

    def to_control(self) -> Any:
        """Return the model as a ``StateSpace`` of python-control, with named states, inputs and outputs."""
        import control

        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.states)}
        return control.ss(self.A, self.B, self.C, self.D, **names)

    def save(self, path: Path) -> None:
        """Write the model to ``path``: for MATLAB and Octave if the suffix is ``.mat``, else as numpy's ``.npz``."""
        with path.open("wb") as stream:
            if path.suffix == ".mat":
                from scipy.io import savemat

                cells = {name: np.array(v, object) if isinstance(v, list) else v for name, v in self.as_dict().items()}
                savemat(stream, cells, oned_as="column")
            else:
                np.savez_compressed(stream, **self.as_dict())


def linearise(
    altitude: float | str = "",
    velocity: float | str = "",
    *,
    vehicle: str = "",
    coupling: str = "",
    model: str = "CM",
    reading: str = "",
) -> LinearModel:
    """Return the linear model at a level trim (paper eq. 6 to eq. 9; for the ECM eq. 40 to eq. 43), SI.

    The model of a rigid vehicle has no elastic states.

    Args:
        altitude: m, or a text with unit; empty: the published altitude, or the middle of the vehicle's envelope.
        velocity: m/s, or a text with unit; empty: likewise.
        vehicle: Name or path of a vehicle; empty: the paper's.
        coupling: Set of inertial coupling, or a multiple of the derived set; empty: the vehicle's default.
        model: Coupled (CM), decoupled (DM), or extended by the notch filter with default parameters (ECM).
        reading: Pitch rate in eq. 40, for the ECM only: ``physical`` (q, the default) or ``printed`` (q').

    Raises:
        QuantityError: An argument is wrong; the message names it.
        TrimError: There is no equilibrium at this point.
        VehicleError: The vehicle is unknown or its data are wrong.
    """
    for name, value, known in (("model", model, (*MODELS, EXTENDED)), ("reading", reading or READINGS[0], READINGS)):
        if value not in known:
            raise QuantityError(f"{name} = {value!r}: expected {one_of(known, value)}")
    if reading and model != EXTENDED:
        raise QuantityError(f"reading = {reading!r}: expected with model {EXTENDED} only")
    described = load_vehicle(vehicle or DEFAULT_VEHICLE)
    coupling = described.coupling_name(coupling)
    parameters = described.coupled(coupling)
    if model == "DM":
        parameters, coupling = parameters.decoupled(), "none"
    point = trim_at(parameters, *described.condition(altitude, velocity))
    state, states = point.state, dict(zip(STATE_NAMES, STATE_UNITS, strict=True))
    if model == EXTENDED:
        notch = Filter(*series(continuous(default_sections())))
        reading = reading or READINGS[0]
        state = extended_state(point.state, notch)
        A, B = extended_jacobian(state, point.input, parameters, notch, reading == "printed")
        states = {"filtered_pitch_rate" if name == "pitch_rate" else name: unit for name, unit in states.items()}
        states |= {f"filter_{i + 1}": FILTER_UNITS[i % 2] for i in range(len(notch.B))}
    else:
        A, B = jacobian(point.state, point.input, parameters)
    if not parameters.form.elastic:
        kept = [i for i in range(len(A)) if not N_RIGID <= i < N_STATES]
        A, B, state = A[np.ix_(kept, kept)], B[kept], state[kept]
        states = {name: unit for i, (name, unit) in enumerate(states.items()) if i in kept}
    C, D = np.eye(len(A)), np.zeros_like(B)
    inputs = dict(zip(INPUT_NAMES, INPUT_UNITS, strict=True))
    named = (vehicle or DEFAULT_VEHICLE, coupling, model, reading)
    return LinearModel(A, B, C, D, states, inputs, state, point.input, *named)

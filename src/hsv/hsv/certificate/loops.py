"""The linear sampled loop: the trimmed vehicle or a vertex under held inputs, actuators, delay, notch filter and F.

Design, verification, pages and the studies of ``hsv_paper`` all build the matrices of the loop here; a test compares
them with flights. Nothing in this module depends on a margin.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import NotchSection, discretise, with_notch
from hsv.model.actuators import ACTUATOR_SETS, IDEAL, ActuatorSet
from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.actuated import behind_sampled, held_behind, sampled_actuators
from hsv.model.signals import INPUT_NAMES, N_RIGID, N_STATES, PITCH_RATE, STATE_NAMES
from hsv.model.trim import trim

INPUTS = {"fuel": [0], "elevator": [1], "both": [0, 1]}
"""Inputs (columns of B) at which a loop is broken, by the name of the loop; the other input's loop stays closed."""

MEASUREMENTS = STATE_NAMES[:N_RIGID]
"""Measurements that F uses; breaking the loop at one leaves the others closed."""

ELEVATOR = INPUT_NAMES.index("elevator_deflection")


@dataclass(frozen=True)
class Hardware:
    """Hardware between command and vehicle: linear ``actuators``, at most one per channel, and a ``delay`` (s)."""

    actuators: tuple[ActuatorSet, ...] = ()
    delay: float = 0.0

    @classmethod
    def of(cls, elevator: str) -> Hardware:
        """Return ideal hardware, or a published elevator together with the fuel delivery of 10 rad/s."""
        return cls() if elevator == IDEAL else cls((ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS[elevator]))


NO_HARDWARE = Hardware()


@dataclass(frozen=True)
class BrokenLoop:
    """A closed loop seen where it is broken: S(z) = I + C (z I - A)^-1 B is the sensitivity there.

    ``A`` (n, n) is the matrix of the closed loop, ``B`` (n, m) and ``C`` (m, n) lead to and from the m broken signals;
    ``period`` is in s. The loop transfer function of a single signal is L = 1 / S - 1, and -1 is its critical point.
    """

    name: str
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    period: float

    def sensitivity(self, frequencies: np.ndarray) -> np.ndarray:
        """Return S, complex (f, m, m), at ``frequencies`` (f) in rad/s; fast, by the modes of A."""
        poles, entering, leaving = self._modes
        z = np.exp(1j * np.asarray(frequencies, float) * self.period)
        return np.eye(len(self.C)) + np.einsum("an,fn,nb->fab", leaving, 1.0 / (z[:, None] - poles), entering)

    def sensitivity_at(self, frequency: float) -> np.ndarray:
        """Return S, complex (m, m), at a ``frequency`` (rad/s), by a linear system: exact even for a defective A."""
        z = np.exp(1j * frequency * self.period)
        return np.asarray(np.eye(len(self.C)) + self.C @ np.linalg.solve(z * np.eye(len(self.A)) - self.A, self.B))

    def transfer(self, frequency: float) -> complex:
        """Return the loop transfer function L = 1 / S - 1 of a single signal at a ``frequency`` (rad/s)."""
        return complex(1.0 / self.sensitivity_at(frequency)[0, 0] - 1.0)

    @cached_property
    def _modes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        poles, modes = np.linalg.eig(self.A)
        return poles, np.linalg.solve(modes, self.B.astype(complex)), self.C @ modes

    @cached_property
    def growth(self) -> float:
        """The largest real part (1/s) of the poles in continuous time; the loop is stable if it is below zero."""
        return float(np.log(np.abs(np.linalg.eigvals(self.A)).max()) / self.period)


@dataclass(frozen=True)
class SampledLoop:
    """The open loop A (n, n), B (n, 2), the gain (2, n) of u = gain x, and the period (s).

    The states are those of the vehicle (9; 5 of a rigid one or a vertex), the actuators, the delay and, last, the
    ``filter_states`` of the notch filter. B includes the effectiveness of the elevator.
    """

    A: np.ndarray
    B: np.ndarray
    gain: np.ndarray
    period: float
    filter_states: int = 0

    @property
    def closed(self) -> np.ndarray:
        """The matrix (n, n) of the closed loop."""
        return np.asarray(self.A + self.B @ self.gain)

    @property
    def poles(self) -> np.ndarray:
        """The n poles of the closed loop, complex, converted to continuous time (rad/s)."""
        # A delay has poles at z = 0, whose logarithm is minus infinity.
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(np.linalg.eigvals(self.closed).astype(complex)) / self.period)

    @property
    def growth(self) -> float:
        """The largest real part of all poles, 1/s; the loop is stable if it is below zero."""
        return float(self.poles.real.max())

    def scaled(self, factor: float, name: str) -> SampledLoop:
        """Return the loop with ``factor`` times the row of the gain that drives the input ``name``, or both rows."""
        gain = self.gain.copy()
        gain[INPUTS[name]] *= factor
        return replace(self, gain=gain)

    def broken(self, name: str) -> BrokenLoop:
        """Return the loop broken at the inputs or at the measurement ``name``, of :data:`INPUTS` or MEASUREMENTS."""
        if name in INPUTS:
            entering, leaving = self.B[:, INPUTS[name]], self.gain[INPUTS[name]]
        else:
            state = MEASUREMENTS.index(name)
            entering, leaving = (self.B @ self.gain[:, state])[:, None], np.eye(1, len(self.A), state)
            if state == PITCH_RATE:
                # This measurement also drives the filter.
                first = len(self.A) - self.filter_states
                entering[first:, 0] += self.A[first:, PITCH_RATE]
        return BrokenLoop(name, self.closed, entering, leaving, self.period)


@dataclass(frozen=True, eq=False)
class Feedback:
    """A state feedback: its gain (2, 9), notch filter on the pitch rate, period (s), and hardware."""

    gain: np.ndarray
    notch: tuple[NotchSection, ...]
    period: float
    hardware: Hardware = NO_HARDWARE

    @classmethod
    def of(
        cls, design: ControlDesign, factor: float = 1.0, *, notched: bool = True, hardware: Hardware = NO_HARDWARE
    ) -> Feedback:
        """Return the feedback with ``factor`` times the gain F of a design, with or without its notch filter."""
        return cls(factor * design.feedback_gain, design.notch if notched else (), design.period, hardware)

    def around(self, vehicle: VehicleParameters, point: tuple[float, float], effectiveness: float = 1.0) -> SampledLoop:
        """Return the loop around a vehicle in trim at ``point``: altitude (m) and velocity (m/s).

        Raises:
            TrimError: There is no equilibrium at this point.
        """
        held, inputs = _held(vehicle, point, self.period, self.hardware)
        full = np.zeros((len(self.gain), len(held)))
        states = N_STATES if vehicle.form.elastic else N_RIGID
        full[:, :states] = self.gain[:, :states]
        A, B, gain = with_notch(held, inputs, full, discretise(self.notch, self.period))
        B[:, ELEVATOR] *= effectiveness
        return SampledLoop(A, B, gain, self.period, len(A) - len(held))


@lru_cache(maxsize=8192)
def _held(
    vehicle: VehicleParameters, point: tuple[float, float], period: float, hardware: Hardware
) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete A (n, n) and B (n, 2) of the trimmed vehicle behind ``hardware``, cached for many loops."""
    equilibrium = trim(vehicle, *point)
    A, B = jacobian(equilibrium.state, equilibrium.input, vehicle)
    if not vehicle.form.elastic:
        A, B = A[:N_RIGID, :N_RIGID], B[:N_RIGID]
    return held_behind(A, B, period, hardware.actuators, hardware.delay)


def vertex_loops(design: ControlDesign) -> list[SampledLoop]:
    """Return the loop at each vertex of a design: rigid states (eq. 12), actuators of the design, notch filter, F.

    Actuators act by their mean positions over a period, as in the error system of the design.
    """
    A, B = design.polytope.A[:, :N_RIGID, :N_RIGID], design.polytope.B[:, :N_RIGID]
    if design.actuators:
        A, B = behind_sampled(A, B, sampled_actuators(design.actuator_sets, design.period))
    gain = np.zeros((len(INPUT_NAMES), A.shape[-1]))
    gain[:, :N_RIGID] = design.feedback_gain[:, :N_RIGID]
    A, B, gain = with_notch(A, B, gain, discretise(design.notch, design.period))
    filters = 2 * len(design.notch)
    return [SampledLoop(*vertex, gain, design.period, filters) for vertex in zip(A, B, strict=True)]

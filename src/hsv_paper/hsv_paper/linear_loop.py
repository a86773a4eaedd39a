"""The linear sampled loop: vehicle at trim under held inputs, discrete notch filter, and feedback gain F.

Actuators and a delay may act between controller and vehicle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import brentq

from hsv.base.units import FOOT
from hsv.control.design import ControlDesign
from hsv.control.notch_filter import NotchSection, discretise, with_notch
from hsv.model.actuators import ACTUATOR_SETS, IDEAL, ActuatorSet
from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.actuated import held_behind
from hsv.model.signals import N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

START = (85500.0 * FOOT, 7900.0 * FOOT)
TARGET = (86100.0 * FOOT, 8150.0 * FOOT)
"""Altitude (m) and velocity (m/s) at which Case 1 starts and ends."""

EFFECTIVENESS = (1.0, 0.9)
"""Effectiveness of the elevator before and after Case 1's fault."""

ELEVATOR = 1

COUPLING_SCALES = tuple(0.05 * step for step in range(26))
"""Multiples kappa of the derived coupling, between which limits of stability are bracketed."""

Corners = Sequence[Mapping[str, float]]
"""Relative changes of the vehicle's parameters, one mapping per vehicle."""

NOMINAL: Corners = ({},)


@dataclass(frozen=True)
class Hardware:
    """Hardware between command and vehicle: linear ``actuators``, at most one per channel, and a ``delay`` (s)."""

    actuators: tuple[ActuatorSet, ...] = ()
    delay: float = 0.0

    @classmethod
    def of(cls, elevator: str) -> Hardware:
        """Return ideal hardware, or a published elevator together with the fuel delivery of 10 rad/s."""
        return cls() if elevator == IDEAL else cls((ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS[elevator]))


NO_HARDWARE = Hardware.of(IDEAL)


@dataclass(frozen=True)
class SampledLoop:
    """The open loop A (n, n), B (n, 2), the gain (2, n) of u = gain x, and the period (s).

    The states are those of vehicle (9), actuators, delay and filter. B includes the effectiveness of the elevator.
    """

    A: np.ndarray
    B: np.ndarray
    gain: np.ndarray
    period: float

    @property
    def poles(self) -> np.ndarray:
        """The n poles of the closed loop, complex, converted to continuous time (rad/s)."""
        closed = np.linalg.eigvals(self.A + self.B @ self.gain).astype(complex)
        return np.asarray(np.log(closed) / self.period)

    @property
    def growth(self) -> float:
        """The largest real part of all poles, 1/s; the loop is stable if it is below zero."""
        return float(self.poles.real.max())

    def command_noise(self, noise: np.ndarray) -> np.ndarray:
        """Return the inputs' standard deviations (SI); ``noise`` (9) has those of the states' white measurement noise.

        Raises:
            numpy.linalg.LinAlgError: The loop is unstable.
        """
        if self.growth >= 0.0:
            raise np.linalg.LinAlgError(f"growth {self.growth:.3g} 1/s, expected a stable loop")
        direct = self.gain[:, :N_STATES] * noise
        entering = self.B @ direct
        # Of the measurements, only the pitch rate enters the filter.
        entering[N_STATES:, PITCH_RATE] += self.A[N_STATES:, PITCH_RATE] * noise[PITCH_RATE]
        P = solve_discrete_lyapunov(self.A + self.B @ self.gain, entering @ entering.T)
        return np.asarray(np.sqrt(np.diag(self.gain @ P @ self.gain.T + direct @ direct.T)))

    def elevator_loop(self, frequencies: np.ndarray) -> np.ndarray:
        """Return the complex response L of the loop broken at the elevator, the fuel loop closed; -1 is critical."""
        A = self.A + np.outer(self.B[:, 1 - ELEVATOR], self.gain[1 - ELEVATOR])
        poles, modes = np.linalg.eig(A)
        residues = (self.gain[ELEVATOR] @ modes) * np.linalg.solve(modes, self.B[:, ELEVATOR])
        z = np.exp(1j * np.asarray(frequencies, float) * self.period)
        return np.asarray(-(residues / (z[:, None] - poles)).sum(axis=1))


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

    def around(
        self, vehicle: VehicleParameters, point: tuple[float, float] = TARGET, effectiveness: float = 1.0
    ) -> SampledLoop:
        """Return the loop around a vehicle in trim at ``point``: altitude (m) and velocity (m/s).

        Raises:
            TrimError: There is no equilibrium at this point.
        """
        held, inputs = _held(vehicle, point, self.period, self.hardware)
        full = np.zeros((len(self.gain), len(held)))
        full[:, : self.gain.shape[1]] = self.gain
        A, B, gain = with_notch(held, inputs, full, discretise(self.notch, self.period))
        B[:, ELEVATOR] *= effectiveness
        return SampledLoop(A, B, gain, self.period)

    def growths(self, vehicle: VehicleParameters, over: Corners) -> np.ndarray:
        """Return, by vehicle, the largest growth (1/s) at Case 1's start and target, before and after its fault."""
        return np.array(
            [
                max(
                    self.around(vehicle.perturbed(corner), point, share).growth
                    for point in (START, TARGET)
                    for share in EFFECTIVENESS
                )
                for corner in over
            ]
        )

    def growth(self, vehicle: VehicleParameters, over: Corners = NOMINAL) -> float:
        """Return the largest of the :meth:`growths` (1/s) of the vehicles ``over``."""
        return float(self.growths(vehicle, over).max())

    def critical_coupling(self, over: Corners = NOMINAL) -> float | None:
        """Return the least multiple kappa of the derived coupling at which a vehicle of ``over`` becomes unstable.

        0: one is unstable even without coupling. None: all are stable at all :data:`COUPLING_SCALES`.
        """
        return stability_limit(lambda kappa: self.growth(load_vehicle().coupled(kappa), over), COUPLING_SCALES)


@lru_cache(maxsize=8192)
def _held(
    vehicle: VehicleParameters, point: tuple[float, float], period: float, hardware: Hardware
) -> tuple[np.ndarray, np.ndarray]:
    """Return the discrete A (n, n) and B (n, 2) of the trimmed vehicle behind ``hardware``, cached for many loops."""
    equilibrium = trim(vehicle, *point)
    A, B = jacobian(equilibrium.state, equilibrium.input, vehicle)
    return held_behind(A, B, period, hardware.actuators, hardware.delay)


def crossings(growth: Callable[[float], float], along: Sequence[float], tolerance: float = 1e-6) -> Iterator[float]:
    """Yield, in the order of ``along``, the scalars at which ``growth`` changes its sign.

    Args:
        growth: Largest real part (1/s) of a loop's poles as a function of a scalar, such as kappa.
        along: Values of the scalar, increasing or decreasing, so dense that no two crossings lie between neighbours.
        tolerance: Tolerance of a crossing, as a fraction of the interval that it lies in.
    """
    stable = growth(along[0]) < 0.0
    for before, value in pairwise(along):
        if (growth(value) < 0.0) != stable:
            stable = not stable
            yield float(brentq(growth, before, value, xtol=tolerance * abs(value - before)))


def stability_limit(growth: Callable[[float], float], along: Sequence[float], tolerance: float = 1e-6) -> float | None:
    """Return the first scalar, in the order of ``along``, at which a loop becomes unstable.

    Arguments as for :func:`crossings`. ``along[0]`` if it is unstable there; None if stable at all values of ``along``.
    """
    return float(along[0]) if growth(along[0]) >= 0.0 else next(crossings(growth, along, tolerance), None)


def phase_margins(frequencies: np.ndarray, response: np.ndarray) -> np.ndarray:
    """Return frequency (rad/s) and phase margin (rad) where the ``response`` L crosses unit gain, shape (n, 2).

    The phase margin is the magnitude of the angle between L and -1. The logarithm of L is interpolated linearly.
    """
    gain, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    i = np.flatnonzero(np.sign(gain[:-1]) != np.sign(gain[1:]))
    share = gain[i] / (gain[i] - gain[i + 1])
    at, angle = (values[i] + share * (values[i + 1] - values[i]) for values in (frequencies, phase))
    return np.stack((at, np.abs(np.angle(np.exp(1j * (angle - np.pi))))), axis=1)

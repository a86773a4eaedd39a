"""The sampled closed loop, linear: the vehicle at trim under held inputs, the discrete notch filter, the feedback F.

Actuators and a delay may stand between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import solve_discrete_lyapunov
from scipy.optimize import brentq

from hsv.base.units import FOOT
from hsv.control.notch_filter import NotchSection, discretise, with_notch
from hsv.model.actuators import ActuatorSet
from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.actuated import held_behind
from hsv.model.signals import N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle

START = (85500.0 * FOOT, 7900.0 * FOOT)
TARGET = (86100.0 * FOOT, 8150.0 * FOOT)
"""Altitude (m) and velocity (m/s) at which Case 1 starts and ends."""

EFFECTIVENESS = (1.0, 0.9)
"""Effectiveness of the elevator before and after the fault."""

ELEVATOR = 1

COUPLING_SCALES = tuple(0.05 * step for step in range(26))
"""kappa, times the derived coupling, between which the limit of stability is looked for."""


@dataclass(frozen=True)
class Hardware:
    """Hardware between command and vehicle: linear ``actuators``, at most one per channel, and a ``delay`` (s)."""

    actuators: tuple[ActuatorSet, ...] = ()
    delay: float = 0.0


IDEAL = Hardware()


@dataclass(frozen=True)
class SampledLoop:
    """A (n, n) of vehicle (9), actuators, delay and filter, the loop open; B (n, 2) of the inputs; gain (2, n) of u.

    ``period`` in s; the effectiveness of the elevator is in B.
    """

    A: np.ndarray
    B: np.ndarray
    gain: np.ndarray
    period: float

    @property
    def poles(self) -> np.ndarray:
        """Poles of the closed loop as continuous ones, rad/s, complex."""
        closed = np.linalg.eigvals(self.A + self.B @ self.gain).astype(complex)
        return np.asarray(np.log(closed) / self.period)

    @property
    def growth(self) -> float:
        """Largest real part of all poles, 1/s: below zero the loop is stable."""
        return float(self.poles.real.max())

    def command_noise(self, noise: np.ndarray) -> np.ndarray:
        """Return the standard deviations (2) of the command under white measurement ``noise`` (9 deviations), SI.

        Raises:
            numpy.linalg.LinAlgError: The loop is unstable.
        """
        if self.growth >= 0.0:
            raise np.linalg.LinAlgError(f"growth {self.growth:.3g} 1/s, expected a stable loop")
        direct = self.gain[:, :N_STATES] * noise
        entering = self.B @ direct
        # Of what follows the vehicle's states the pitch rate moves the filter alone.
        entering[N_STATES:, PITCH_RATE] += self.A[N_STATES:, PITCH_RATE] * noise[PITCH_RATE]
        P = solve_discrete_lyapunov(self.A + self.B @ self.gain, entering @ entering.T)
        return np.asarray(np.sqrt(np.diag(self.gain @ P @ self.gain.T + direct @ direct.T)))

    def elevator_loop(self, frequencies: np.ndarray) -> np.ndarray:
        """Return L (f), the response of the loop broken at the elevator, the other input closed; -1 is critical."""
        A = self.A + np.outer(self.B[:, 1 - ELEVATOR], self.gain[1 - ELEVATOR])
        poles, modes = np.linalg.eig(A)
        residues = (self.gain[ELEVATOR] @ modes) * np.linalg.solve(modes, self.B[:, ELEVATOR])
        z = np.exp(1j * np.asarray(frequencies, float) * self.period)
        return np.asarray(-(residues / (z[:, None] - poles)).sum(axis=1))


def sampled_loop(
    vehicle: VehicleParameters,
    feedback: np.ndarray,
    notch: Sequence[NotchSection],
    period: float,
    *,
    point: tuple[float, float] = TARGET,
    effectiveness: float = 1.0,
    hardware: Hardware = IDEAL,
) -> SampledLoop:
    """Return the loop around ``vehicle``.

    Args:
        vehicle: Coupled or not.
        feedback: (2, 9) gain F (times tau) on the states, the filtered pitch rate among them.
        notch: Sections of the filter, none: the pitch rate passes.
        period: Control period (s).
        point: Altitude (m) and velocity (m/s) of the trim.
        effectiveness: Effectiveness of the elevator.
        hardware: Between command and vehicle.

    Raises:
        TrimError: No equilibrium there.
    """
    held, inputs = _held(vehicle, point, period, hardware)
    full = np.zeros((len(feedback), len(held)))
    full[:, : feedback.shape[1]] = feedback
    A, B, gain = with_notch(held, inputs, full, discretise(notch, period))
    B[:, ELEVATOR] *= effectiveness
    return SampledLoop(A, B, gain, period)


@lru_cache(maxsize=8192)
def _held(
    vehicle: VehicleParameters, point: tuple[float, float], period: float, hardware: Hardware
) -> tuple[np.ndarray, np.ndarray]:
    """Return A (n, n) and B (n, 2) of the vehicle at trim behind ``hardware``; kept, for many loops go around each."""
    equilibrium = trim(vehicle, *point)
    A, B = jacobian(equilibrium.state, equilibrium.input, vehicle)
    return held_behind(A, B, period, hardware.actuators, hardware.delay)


def worst_growth(
    vehicle: VehicleParameters,
    feedback: np.ndarray,
    notch: Sequence[NotchSection],
    period: float,
    hardware: Hardware = IDEAL,
) -> float:
    """Return the largest growth (1/s) of the loop at both ends of Case 1's step, before and after its fault.

    Args:
        vehicle: See :func:`sampled_loop`, also for ``feedback``, ``notch`` and ``period``.
        feedback: (2, 9).
        notch: Sections of the filter.
        period: Control period (s).
        hardware: Between command and vehicle.
    """
    return max(
        sampled_loop(vehicle, feedback, notch, period, point=point, effectiveness=share, hardware=hardware).growth
        for point in (START, TARGET)
        for share in EFFECTIVENESS
    )


def stability_limit(growth: Callable[[float], float], along: Sequence[float], tolerance: float = 1e-6) -> float | None:
    """Return where ``growth`` first reaches zero going ``along`` its argument, by root finding between the points.

    Args:
        growth: Largest real part (1/s) of a loop's poles over a scalar, such as kappa.
        along: Values of the scalar, increasing or decreasing, so dense that no loss is over between two of them.
        tolerance: Tolerance of the limit, as a fraction of the interval it lies in.

    Returns:
        The limit; the first value if the loop is not stable there; ``None`` if it
        is stable at all values.
    """
    before = None
    for value in map(float, along):
        if growth(value) >= 0.0:
            if before is None:
                return value
            return float(brentq(growth, before, value, xtol=tolerance * abs(value - before)))
        before = value
    return None


def crossings(growth: Callable[[float], float], along: Sequence[float]) -> list[float]:
    """Return all values at which ``growth`` changes its sign going ``along`` its argument, by root finding.

    Args:
        growth: Largest real part (1/s) of a loop's poles over a scalar, such as a bandwidth.
        along: Values of the scalar, increasing, so dense that at most one change is between two of them.
    """
    values = [growth(float(value)) for value in along]
    return [
        float(brentq(growth, along[i], along[i + 1], xtol=1e-6 * (along[i + 1] - along[i])))
        for i in range(len(values) - 1)
        if (values[i] < 0.0) != (values[i + 1] < 0.0)
    ]


def critical_coupling(
    feedback: np.ndarray,
    notch: Sequence[NotchSection],
    period: float,
    over: Sequence[Mapping[str, float]] = ({},),
    hardware: Hardware = IDEAL,
) -> float | None:
    """Return the scale kappa of the derived coupling at which the loop stops being stable, of the first vehicle to.

    Args:
        feedback: (2, 9), as for :func:`sampled_loop`, and so are ``notch`` and ``period``.
        notch: Sections of the filter.
        period: Control period (s).
        over: Relative changes of the vehicle's parameters; the nominal vehicle alone unless given.
        hardware: Between command and vehicle.

    Returns:
        ``None`` if every loop is stable up to the last of :data:`COUPLING_SCALES`.
    """

    def growth(kappa: float) -> float:
        vehicle = load_vehicle().coupled(kappa)
        return max(worst_growth(vehicle.perturbed(corner), feedback, notch, period, hardware) for corner in over)

    return stability_limit(growth, COUPLING_SCALES)


@dataclass(frozen=True)
class Margin:
    """A crossing of unit gain: frequency (rad/s) and phase margin (rad, its distance from -1 on the circle)."""

    frequency: float
    phase: float


def phase_margins(frequencies: np.ndarray, response: np.ndarray) -> list[Margin]:
    """Return the phase margin at every crossing of unit gain of L (f), by linear interpolation of its logarithm."""
    gain, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    margins = []
    for i in np.flatnonzero(np.sign(gain[:-1]) != np.sign(gain[1:])):
        share = gain[i] / (gain[i] - gain[i + 1])
        angle = phase[i] + share * (phase[i + 1] - phase[i])
        distance = np.abs(np.angle(np.exp(1j * (angle - np.pi))))
        margins.append(Margin(float(frequencies[i] + share * (frequencies[i + 1] - frequencies[i])), float(distance)))
    return margins

"""Disturbance sets of the error system (paper eq. 13 to eq. 19): boxes, and the structured set with one-sided fault.

The error of the polytopic model over one period, with the commanded input u, is

    Delta(k) = x(k+1) - phi_T(x_r(k), u_r(k)) - A(p) (x(k) - x_r(k)) - B(p) (u(k) - u_r(k)).

Here phi_T is the flow of the nominal vehicle over one period: phi_T(x_r(k), u_r(k)) = x_r(k+1) + d_r(k) with the defect
d_r, which is zero where the reference is constant (see :mod:`hsv.control.reference_trajectory`). The fault is known
exactly: w = B(p) (P - I) u, with the effectiveness P and the *total* elevator in u, trim included. The rest,
f = Delta - w, comes from linearisation, interpolation, parameters and flexibility.

The structured set represents the rigid part of Delta completely: by three accelerations held over a period, by the lost
elevator, which acts through the elevator's column B_e(p), and by residuals of altitude and pitch angle. One more
channel is notch(q_n) - q_n, with q_n the nominal pitch rate. It acts by B(p) F_q, with F_q the pitch-rate column of F.

If the design includes actuators, u in Delta is their mean position over the period, and w is due to their response to
the lost elevator. For their lag behind the plan see :mod:`hsv.design.error_system`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.core import Struct, doubles, lib
from hsv.design.error_system import tube_errors
from hsv.flight.flight import Flight
from hsv.flight.responses import along_filter, lag_response
from hsv.lmi.semidefinite import outward
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import ACCELERATED, CHANNELS, N_INPUTS, N_RIGID, N_STATES, PITCH_RATE, REMAINING
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle

_FILTERED_NOMINAL = 4


class Signals(NamedTuple):
    """Disturbances of a flight, a row per step, SI: ``channels`` (n, 7) in the order of :data:`CHANNELS`.

    ``delta`` and ``fault`` (n, 9) are Delta and w, changes of the state per period.
    """

    channels: np.ndarray
    delta: np.ndarray
    fault: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """The disturbance f = Delta - w (paper eq. 13), shape (n, 9)."""
        return self.delta - self.fault


@dataclass(frozen=True)
class ChannelModel:
    """Decomposition of the model error Delta into the disturbance channels of a ``design`` for ``vehicle``.

    The channel of the filtered nominal rate is zero if the design filters the nominal pitch rate like the measured one.
    """

    design: ControlDesign
    vehicle: Vehicle

    @cached_property
    def notch(self) -> Struct:
        """The notch filter of the design, in discrete time."""
        return discretise(self.design.notch, self.design.period)

    @cached_property
    def columns(self) -> np.ndarray:
        """Change (5, 3) of the rigid states over a period by a unit of each acceleration channel."""
        return acceleration_channels(self.vehicle, self.design.period)

    @cached_property
    def actuators(self) -> Struct | None:
        """The sampled actuators of the design; None: ideal actuators."""
        known = self.design.actuator_sets
        return sampled_actuators(known, self.design.period) if known else None

    def signals(self, flight: Flight) -> Signals:
        """Return the disturbances f, w and Delta of ``flight`` and their channels (paper eq. 13, eq. 16, eq. 18)."""
        h = flight.history
        commanded, lost = h.command, h.actuator[:, 1] - h.command[:, 1]
        through = lost
        if self.actuators is not None:
            at_rest = self.at_rest(flight)
            commanded = at_rest + respond(self.actuators, h.command - at_rest)[1]
            through = respond(self.actuators, np.stack((np.zeros_like(lost), lost), axis=1))[1][:, 1]
        inverse, remaining = np.linalg.inv(self.columns[ACCELERATED]), self.columns[REMAINING]
        signals = decompose(self.design.polytope, self.notch, inverse, remaining, flight, commanded, lost, through)
        if self.design.filtered:
            signals.channels[:, _FILTERED_NOMINAL] = 0.0
        return signals

    def errors(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """Return the tube error (n + 1, states) of ``flight`` and the feedback (n + 1, 2) due to the actuators' lag.

        The tube error is e minus the effect of the lag behind the plan. Ideal actuators have no lag: the feedback is 0.
        """
        h = flight.history
        if self.actuators is None:
            return tube_errors(h.state, h.deviation, flight.reference, self.notch), np.zeros_like(h.command)
        beyond = h.actuator - flight.plan
        e = tube_errors(h.state, h.deviation, flight.reference, self.notch, self.actuators, beyond)
        late, feedback = self.lag(flight)
        return e - late, feedback

    def lag(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """Return the responses of e (n + 1, states) and feedback (n + 1, 2) to the actuators' lag behind the plan."""
        assert self.actuators is not None
        at_rest, design = self.at_rest(flight), self.design
        lag = at_rest + respond(self.actuators, flight.plan - at_rest)[1] - flight.plan
        gain, scheduled_at = design.adjusted_gain(design.tau)[:, :N_RIGID], flight.history.state[:, :2]
        return lag_response(design.polytope, gain, self.notch, self.actuators, scheduled_at, lag)

    def at_rest(self, flight: Flight) -> np.ndarray:
        """Return the actuators' rest positions before ``flight``, shape (2,): the trim input at its first state."""
        return trim(self.vehicle.decoupled, *flight.history.state[0, :2]).input


def decompose(
    polytope: Polytope,
    notch: Struct,
    inverse: np.ndarray,
    remaining: np.ndarray,
    flight: Flight,
    command: np.ndarray,
    lost: np.ndarray,
    through: np.ndarray,
) -> Signals:
    """Return the disturbances of a flight, with the same bits on every machine: sums over columns have a fixed order.

    Args:
        polytope: The polytopic model of the design.
        notch: The notch filter in discrete time.
        inverse: (3, 3) inverse of the rows :data:`ACCELERATED` of :func:`acceleration_channels`.
        remaining: (2, 3) rows :data:`REMAINING` of :func:`acceleration_channels`.
        flight: The flight, with n + 1 rows in its history.
        command: (n + 1, 2) commanded input, or mean actuator position over each period if the design has actuators.
        lost: (n + 1) lost elevator: actuator input minus command, rad.
        through: (n + 1) mean response of the actuators to ``lost``; ``lost`` itself for ideal actuators.
    """
    h, x_r, n = flight.history, flight.reference[:-1], len(flight.history.state) - 1
    S = scheduled(polytope, h.state[:-1, :2])
    # State and input minus the reference: the vector that [A(p), B(p)] multiplies.
    moved = np.hstack((h.state[:-1] - x_r, (command - flight.reference_input)[:-1]))
    # Rounding costs a millionth of the residuals. Adding x - x_r first would avoid this, but change one design.
    predicted = flight.reference[1:] + flight.defect[:-1]
    for j in range(N_STATES + N_INPUTS):
        predicted += S[:, :, j] * moved[:, j, None]
    delta = h.state[1:] - predicted
    fault = S[:, :, -1] * through[:-1, None]
    rest = delta - fault
    channels = np.zeros((n, len(CHANNELS)))
    for j, row in enumerate(ACCELERATED):
        channels[:, :3] += inverse[:, j] * rest[:, row, None]
    channels[:, 3] = lost[:-1]
    planned = (h.deviation[:-1] + x_r)[:, PITCH_RATE]
    channels[:, _FILTERED_NOMINAL] = along_filter(notch, planned)[0] - planned
    explained = np.zeros((n, len(REMAINING)))
    for j in range(3):
        explained += remaining[:, j] * channels[:, j, None]
    channels[:, 5:] = rest[:, REMAINING] - explained
    return Signals(channels, delta, fault)


def scheduled(polytope: Polytope, points: np.ndarray) -> np.ndarray:
    """Return [A(p), B(p)] of paper eq. 11, shape (n, 9, 11), at ``points`` (n, 2): altitude (m) and velocity (m/s)."""
    data, S = polytope.data(), np.empty((len(points), N_STATES, N_STATES + N_INPUTS))
    for point, found in zip(points.tolist(), S, strict=True):
        lib.hsv_schedule(data.pointer, *point, doubles(found))
    return S


@dataclass(frozen=True)
class Membership:
    """Largest ratio of the disturbances of a flight to their bounds, with its channel and step; at most 1: inside."""

    ratio: float
    channel: str
    step: int

    @property
    def inside(self) -> bool:
        """Whether every disturbance of the flight lay in the set."""
        return self.ratio <= 1.0


@dataclass(frozen=True)
class DisturbanceSet:
    """The structured set (paper eq. 19): each of :data:`CHANNELS` between ``lower`` and ``upper``, shape (7,), SI.

    It is computed from the disturbances of some flights; check :meth:`membership` in every other flight. Models of
    hardware and air append further channels to both arrays.
    """

    lower: np.ndarray
    upper: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Mid-points of the bounds by channel; if not zero, as for the one-sided fault, they shift the centre."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths of the bounds, by channel."""
        return 0.5 * (self.upper - self.lower)

    def scaled(self, share: float) -> DisturbanceSet:
        """Return the set with both bounds multiplied by ``share``."""
        return DisturbanceSet(share * self.lower, share * self.upper)

    def membership(self, channels: np.ndarray) -> Membership:
        """Return the largest ratio of the disturbances (n, 7) of a flight to their bounds, with channel and step.

        A positive disturbance is divided by the upper bound, a negative one by the lower; if that bound is zero,
        the ratio is infinite. The ratio of a zero disturbance is 0.
        """
        bounds = np.where(channels > 0.0, self.upper, self.lower)
        ratios = np.full(channels.shape, np.inf)
        np.divide(channels, bounds, out=ratios, where=bounds != 0.0)
        ratios[channels == 0.0] = 0.0
        step, channel = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
        return Membership(float(ratios[step, channel]), CHANNELS[channel].name, int(step))

    def report(self) -> dict[str, Any]:
        """Return the bounds by channel, for JSON."""
        return {
            c.name: {"unit": c.unit, "lower": float(low), "upper": float(high)}
            for c, low, high in zip(CHANNELS, self.lower, self.upper, strict=True)
        }

    @classmethod
    def from_report(cls, report: Mapping[str, Any]) -> DisturbanceSet:
        """Return the set that :meth:`report` wrote."""
        return cls(*(np.array([report[c.name][side] for c in CHANNELS], float) for side in ("lower", "upper")))


def widened(lower: np.ndarray, upper: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Return both bounds, extended to include zero, multiplied by ``factor`` and rounded away from zero."""
    return outward(factor * np.minimum(lower, 0.0)), outward(factor * np.maximum(upper, 0.0))


@dataclass(frozen=True)
class Extremes:
    """Extremes of c quantities over flights, and the indices of the flights that have them; shape (c,) each."""

    lower: np.ndarray
    upper: np.ndarray
    lower_flight: np.ndarray
    upper_flight: np.ndarray

    @classmethod
    def over(cls, lower: np.ndarray, upper: np.ndarray) -> Extremes:
        """Return the extremes over all flights, given the smallest and largest values (flights, c) of each flight."""
        return cls(lower.min(axis=0), upper.max(axis=0), lower.argmin(axis=0), upper.argmax(axis=0))

    def structured(self, inflation: float) -> DisturbanceSet:
        """Return the structured set between these extremes of the channels, :func:`widened` by ``inflation``."""
        return DisturbanceSet(*widened(self.lower, self.upper, inflation))

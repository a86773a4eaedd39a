"""Disturbance sets of the error system (paper eq. 13 to eq. 19): boxes, and the structured set with one-sided fault.

Delta(k) = x(k+1) - phi_T(x_r(k), u_r(k)) - A(p) (x(k) - x_r(k)) - B(p) (u(k) - u_r(k)), u the commanded input, is what
the polytopic model does not explain; the nominal vehicle takes the reference to phi_T = x_r(k+1) + d_r(k), which is x_r
itself where it is constant (see :mod:`hsv.control.reference_trajectory`). w = B(p) (P - I) u, the fault, is known
exactly: u in it is the *total* elevator, trim included. f = Delta - w is the rest: linearisation, interpolation,
parameters, flexible coupling.

The structured set writes the rigid part of Delta as three accelerations held over a period, the lost elevator through
the column B_e(p), and what remains in altitude and pitch angle; a seventh channel is the part of the feedback that
comes from filtering the nominal pitch rate, F_q (notch(q_n) - q_n), which acts through B(p) F_q. Nothing is left out.

Where the design knows its actuators, u above is their mean position over the period under the command,
and w is what of the lost elevator comes through them; see :mod:`hsv.design.error_system` for the lag of the plan.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.control.optimisation import outward
from hsv.core import Struct, doubles, lib
from hsv.design.error_system import tube_errors
from hsv.flight.flight import Flight
from hsv.flight.responses import along_filter, lag_response
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.lpv.linearisation import linearise, zero_order_hold
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import N_INPUTS, N_RIGID, N_STATES, PITCH_RATE
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


class Channel(NamedTuple):
    """One channel of the structured set."""

    name: str
    unit: str
    meaning: str


CHANNELS = (
    Channel("acceleration", "m/s^2", "held acceleration along the velocity"),
    Channel("angle_of_attack_rate", "rad/s", "held rate of the angle of attack"),
    Channel("pitch_acceleration", "rad/s^2", "held pitch acceleration"),
    Channel("lost_elevator", "rad", "actuator less command; total elevator, trim included"),
    Channel("filtered_nominal_rate", "rad/s", "notch(q_n) - q_n, known from the plan"),
    Channel("altitude_residual", "m", "altitude that the accelerations do not explain, per period"),
    Channel("pitch_angle_residual", "rad", "pitch angle that the accelerations do not explain, per period"),
)
"""Order of the columns of G in :class:`hsv.design.error_system.ErrorSystem`."""

_FILTERED_NOMINAL = 4
ACCELERATED, REMAINING = [1, 2, 4], [0, 3]
"""Rigid states that the three accelerations act on, and those in which a residual remains."""


def acceleration_channels(vehicle: Vehicle, period: float) -> np.ndarray:
    """Return the effect (5, 3) on the rigid states of unit accelerations held over ``period`` (s), at mid-envelope."""
    A, _ = linearise(vehicle.decoupled, *vehicle.centre)
    unit = np.zeros((N_RIGID, 3))
    unit[ACCELERATED, [0, 1, 2]] = 1.0
    return zero_order_hold(A[:N_RIGID, :N_RIGID], unit, period)[1]


class Signals(NamedTuple):
    """Disturbances of a flight, a row per step: ``channels`` (n, 7), ``delta`` and ``fault`` (n, 9), SI per period."""

    channels: np.ndarray
    delta: np.ndarray
    fault: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """Delta - w (n, 9), the f of (13)."""
        return self.delta - self.fault


@dataclass(frozen=True)
class ChannelModel:
    """Decomposition of Delta into the channels of ``design``, which is for ``vehicle``.

    Where the nominal pitch rate is filtered as the measured one is, its channel is zero.
    """

    design: ControlDesign
    vehicle: Vehicle

    @cached_property
    def notch(self) -> Struct:
        """The discrete filter."""
        return discretise(self.design.notch, self.design.period)

    @cached_property
    def columns(self) -> np.ndarray:
        """Effect (5, 3) of the accelerations over a period."""
        return acceleration_channels(self.vehicle, self.design.period)

    @cached_property
    def actuators(self) -> Struct | None:
        """The actuators of the design."""
        known = self.design.actuator_sets
        return sampled_actuators(known, self.design.period) if known else None

    def signals(self, flight: Flight) -> Signals:
        """Return the disturbances f, w and Delta that acted in a flight (paper eq. 13, eq. 16, eq. 18)."""
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
        """Return the error in the tube (n + 1, states), and the feedback (n + 1, 2) to the lag of the plan.

        The latter is none without actuators; the former is e less the effect of that lag.
        """
        h = flight.history
        if self.actuators is None:
            return tube_errors(h.state, h.deviation, flight.reference, self.notch), np.zeros_like(h.command)
        beyond = h.actuator - flight.plan
        e = tube_errors(h.state, h.deviation, flight.reference, self.notch, self.actuators, beyond)
        late, feedback = self.lag(flight)
        return e - late, feedback

    def lag(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """Return the effect of the lag of the plan on e (n + 1, states) and on the feedback (n + 1, 2)."""
        assert self.actuators is not None
        at_rest, design = self.at_rest(flight), self.design
        lag = at_rest + respond(self.actuators, flight.plan - at_rest)[1] - flight.plan
        gain, scheduled_at = design.adjusted_gain(design.tau)[:, :N_RIGID], flight.history.state[:, :2]
        return lag_response(design.polytope, gain, self.notch, self.actuators, scheduled_at, lag)

    def at_rest(self, flight: Flight) -> np.ndarray:
        """Return where actuators rest before the flight (2): in the trim that it starts in."""
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
    """Return the disturbances of a flight; sums run over columns in a fixed order, with the same bits on every machine.

    Args:
        polytope: The design's model.
        notch: The discrete filter.
        inverse: (3, 3) from the rates that accelerations change to the accelerations.
        remaining: (2, 3) effect of the accelerations on altitude and pitch angle.
        flight: n + 1 rows.
        command: (n + 1, 2) commanded input, or where the actuators are on average.
        lost: (n + 1) lost elevator.
        through: (n + 1) what of it comes through the actuators.
    """
    h, x_r, n = flight.history, flight.reference[:-1], len(flight.history.state) - 1
    S = scheduled(polytope, h.state[:-1, :2])
    # State and input less the reference: the vector that [A(p), B(p)] multiplies.
    moved = np.hstack((h.state[:-1] - x_r, (command - flight.reference_input)[:-1]))
    # Begun with x - x_r, the sum would keep the millionth of the residuals that it loses; one design would change.
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
    """Return [A(p), B(p)] (n, 9, 11) (paper eq. 11) at ``points`` (n, 2), altitude (m) and velocity (m/s)."""
    data, S = polytope.data(), np.empty((len(points), N_STATES, N_STATES + N_INPUTS))
    for point, found in zip(points.tolist(), S, strict=True):
        lib.hsv_schedule(data.pointer, *point, doubles(found))
    return S


@dataclass(frozen=True)
class Membership:
    """Worst ratio of a disturbance to its bound (at most 1: inside), its channel and step."""

    ratio: float
    channel: str
    step: int

    @property
    def inside(self) -> bool:
        """Whether every disturbance of the flight lay in the set."""
        return self.ratio <= 1.0


@dataclass(frozen=True)
class DisturbanceSet:
    """The structured set: each of :data:`CHANNELS` between ``lower`` and ``upper`` (7), SI (paper eq. 19).

    It bounds the flights that it was computed from. Check :meth:`membership` in every other flight.
    """

    lower: np.ndarray
    upper: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """Mid-points (7): where the one-sided fault moves the tube's centre to."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half_width(self) -> np.ndarray:
        """Half-widths (7)."""
        return 0.5 * (self.upper - self.lower)

    def scaled(self, share: float) -> DisturbanceSet:
        """Return ``share`` times the set, about zero."""
        return DisturbanceSet(share * self.lower, share * self.upper)

    def membership(self, channels: np.ndarray) -> Membership:
        """Return how far the disturbances (n, 7) of a flight reach in the set, and where.

        The ratio is that to the bound on the disturbance's own side of zero; beyond a bound of zero it is infinite.
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
    """Return the bounds, moved apart to hold zero, times ``factor``, rounded outwards."""
    return outward(factor * np.minimum(lower, 0.0)), outward(factor * np.maximum(upper, 0.0))


@dataclass(frozen=True)
class Extremes:
    """Smallest and largest values (c) over flights, and the indices (c) of these flights among the corners."""

    lower: np.ndarray
    upper: np.ndarray
    lower_flight: np.ndarray
    upper_flight: np.ndarray

    @classmethod
    def over(cls, lower: np.ndarray, upper: np.ndarray) -> Extremes:
        """Return the extremes of per-flight ones (flights, c)."""
        return cls(lower.min(axis=0), upper.max(axis=0), lower.argmin(axis=0), upper.argmax(axis=0))

    def structured(self, inflation: float) -> DisturbanceSet:
        """Return the structured set that these extremes of its channels give."""
        return DisturbanceSet(*widened(self.lower, self.upper, inflation))

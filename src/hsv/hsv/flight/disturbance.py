"""Disturbances of a flight (paper eq. 13 to eq. 19) by channel, its tube error, and whether W holds them.

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
the lost elevator. Their lag behind the plan moves the error, too; the tube error is e less this response.

Design and verification both measure flights here; a test predicts the error of each step with the verifier's matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import discretise
from hsv.core import Struct, doubles, lib, vector
from hsv.flight.flight import Flight
from hsv.model.lpv.actuated import respond, sampled_actuators
from hsv.model.lpv.linearisation import acceleration_channels
from hsv.model.lpv.polytope import Polytope
from hsv.model.signals import ACCELERATED, CHANNELS, N_INPUTS, N_RIGID, N_STATES, PITCH_RATE, REMAINING
from hsv.model.trim import trim
from hsv.model.vehicle import Vehicle


@dataclass(frozen=True)
class ChannelModel:
    """Decomposition of the model error Delta into the disturbance channels of a ``design`` for ``vehicle``."""

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

    def channels(self, flight: Flight) -> np.ndarray:
        """Return the disturbances (n, 7) of ``flight`` (paper eq. 13, eq. 16, eq. 18), a row per step, SI.

        They are in the order of :data:`CHANNELS`. The bits are the same on every machine: sums over columns have a
        fixed order. The channel of the filtered nominal rate is zero if the design filters the nominal pitch rate like
        the measured one.
        """
        h, x_r, n = flight.history, flight.reference[:-1], len(flight.history.state) - 1
        lost = h.actuator[:, 1] - h.command[:, 1]
        command, through = h.command, lost
        if self.actuators is not None:
            at_rest = self.at_rest(flight)
            command = at_rest + respond(self.actuators, h.command - at_rest)[1]
            through = respond(self.actuators, np.stack((np.zeros_like(lost), lost), axis=1))[1][:, 1]
        S = scheduled(self.design.polytope, h.state[:-1, :2])
        # State and input minus the reference: the vector that [A(p), B(p)] multiplies.
        moved = np.hstack((h.state[:-1] - x_r, (command - flight.reference_input)[:-1]))
        # Rounding costs a millionth of the residuals. Adding x - x_r first would avoid this, but change one design.
        predicted = flight.reference[1:] + flight.defect[:-1]
        for j in range(N_STATES + N_INPUTS):
            predicted += S[:, :, j] * moved[:, j, None]
        rest = h.state[1:] - predicted - S[:, :, -1] * through[:-1, None]
        inverse, remaining = np.linalg.inv(self.columns[ACCELERATED]), self.columns[REMAINING]
        channels, explained = np.zeros((n, len(CHANNELS))), np.zeros((n, len(REMAINING)))
        for j, row in enumerate(ACCELERATED):
            channels[:, :3] += inverse[:, j] * rest[:, row, None]
        channels[:, 3] = lost[:-1]
        if not self.design.filtered:
            planned = (h.deviation[:-1] + x_r)[:, PITCH_RATE]
            channels[:, 4] = along_filter(self.notch, planned)[0] - planned
        for j in range(3):
            explained += remaining[:, j] * channels[:, j, None]
        channels[:, 5:] = rest[:, REMAINING] - explained
        return channels

    def errors(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """Return the tube error (n + 1, states) of ``flight`` and the feedback (n + 1, 2) due to the actuators' lag.

        The states are the rigid ones, then those of the notch filter and of the design's actuators. Filter and
        actuators are linear, so their errors are their responses to the errors of their inputs. Ideal actuators have
        no lag: the feedback is 0.
        """
        h = flight.history
        rigid = (h.state - h.deviation - flight.reference)[:, :N_RIGID]
        error = np.hstack((rigid, along_filter(self.notch, rigid[:, PITCH_RATE])[1]))
        if self.actuators is None:
            return error, np.zeros_like(h.command)
        late, feedback = self.lag(flight)
        return np.hstack((error, respond(self.actuators, h.actuator - flight.plan)[0])) - late, feedback

    def lag(self, flight: Flight) -> tuple[np.ndarray, np.ndarray]:
        """Return the responses of e (n + 1, states) and feedback (n + 1, 2) to the actuators' lag behind the plan.

        The lag is the mean position over each step of actuators driven by the plan u_r + u_n, minus the plan; the
        error starts at zero.
        """
        assert self.actuators is not None
        at_rest, design, state = self.at_rest(flight), self.design, flight.history.state
        lag = at_rest + respond(self.actuators, flight.plan - at_rest)[1] - flight.plan
        polytope, states = design.polytope.data(), N_RIGID + 2 * len(self.notch.D) + len(self.actuators.A)
        errors, feedback = np.empty((len(lag), states)), np.empty((len(lag), N_INPUTS))
        lib.hsv_lag_response(
            polytope.pointer,
            doubles(vector(design.adjusted_gain(design.tau)[:, :N_RIGID])),
            self.notch.pointer,
            self.actuators.pointer,
            len(lag),
            *(doubles(vector(each)) for each in (state[:, :2], lag, errors, feedback)),
        )
        return errors, feedback

    def at_rest(self, flight: Flight) -> np.ndarray:
        """Return the actuators' rest positions before ``flight``, shape (2,): the trim input at its first state."""
        return trim(self.vehicle.decoupled, *flight.history.state[0, :2]).input


def along_filter(notch: Struct, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the output of the notch filter for the pitch ``rate``, both of shape (k,), and its states, shape (k, s).

    The filter starts at the equilibrium for the first rate. Row i has the s states, two per section, before step i.
    """
    filtered, states = np.empty(len(rate)), np.empty((len(rate), 2 * len(notch.D)))
    lib.hsv_notch_along(notch.pointer, len(rate), *map(doubles, (vector(rate), filtered, states)))
    return filtered, states


def scheduled(polytope: Polytope, points: np.ndarray) -> np.ndarray:
    """Return [A(p), B(p)] of paper eq. 11, shape (n, 9, 11), at ``points`` (n, 2): altitude (m) and velocity (m/s)."""
    data, S = polytope.data(), np.empty((len(points), N_STATES, N_STATES + N_INPUTS))
    for point, found in zip(points.tolist(), S, strict=True):
        lib.hsv_schedule(data.pointer, *point, doubles(found))
    return S


class Membership(NamedTuple):
    """Largest ratio of the disturbances of a flight to their bounds, with its channel and step; at most 1: inside."""

    ratio: float
    channel: str
    step: int


def membership(channels: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> Membership:
    """Return the largest ratio of the disturbances (n, 7) of a flight to the bounds of W, with channel and step.

    A positive disturbance is divided by the upper bound, a negative one by the lower; if that bound is zero,
    the ratio is infinite. The ratio of a zero disturbance is 0.
    """
    bounds = np.where(channels > 0.0, upper, lower)
    ratios = np.where(channels == 0.0, 0.0, np.inf)
    np.divide(channels, bounds, out=ratios, where=bounds != 0.0)
    step, channel = np.unravel_index(int(np.argmax(ratios)), ratios.shape)
    return Membership(float(ratios[step, channel]), CHANNELS[channel].name, int(step))


def plan_extremes(flight: Flight) -> tuple[np.ndarray, np.ndarray]:
    """Return minima and maxima (3 each) of the plan's two inputs u_r + u_n and its nominal pitch acceleration (SI)."""
    plan, turning = flight.plan, np.diff(flight.history.deviation[:, PITCH_RATE]) / flight.period
    return np.append(plan.min(axis=0), turning.min()), np.append(plan.max(axis=0), turning.max())

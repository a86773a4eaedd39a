"""The reference of a flight: piecewise-linear commands and, at each of their points, the equilibrium that flies them.

The reference of a ramp is the climbing, accelerating trim of the nominal decoupled vehicle. It moves, and it does so
under the vehicle's own dynamics: phi_T(x_r(k), u_r(k)), the nominal vehicle over one period, is x_r(k+1) but for

    d_r(k) = phi_T(x_r(k), u_r(k)) - x_r(k+1),

the defect: the jump of a step or of a ramp's corner, and on a ramp the little by which a sequence of trims is not yet a
flight. The nominal system is driven by it, x_n(k+1) = A(p) x_n + B(p) u_n + d_r(k). To drive it by x_r(k) - x_r(k+1)
would take the climb itself, some 6 cm a period, for a disturbance: that is right for a static trim alone, which stays
where it is, phi_T(x_r) = x_r. Where the reference is constant the defect is exactly zero.

Corners may be blended: the piecewise-linear commands averaged over time by a triangle of half-width w. Within w of a
corner, where the rate changes by s, that adds s (w - |t|)^3 / (6 w^2), t the time from it. The rate is then
continuous, and so is its own rate, at most s / w; the next is at most s / w^2: the reference is limited in jerk. There
the flight path turns, and x_r is the trim of a steady pull-up: q_r = h'' / (V cos gamma), the rate of the flight-path
angle. In trims that do not turn, q_r = 0, all of the turn would be left to d_r.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.core import Data, doubles, lib, vector
from hsv.model.dynamics import VehicleParameters, vehicle_struct
from hsv.model.signals import N_INPUTS, N_STATES
from hsv.model.trim import CONVERGED, INITIAL_GUESS, check_equilibrium
from hsv.model.vehicle import Vehicle

TRIMS = ("climbing", "static")

REFERENCE_PARAMETERS = (
    Parameter("reference.times", [0.0], "times of the commands; two equal times define a step", "s", 0.0, 1e5),
    Parameter("reference.altitudes", [26243.28], "commanded altitudes at these times, linear in between", "m"),
    Parameter("reference.velocities", [2484.12], "commanded velocities at these times, linear in between", "m/s"),
    Parameter("reference.blend", 0.0, "half the time in which the rate changes at a corner; 0: at once", "s", 0.0, 1e3),
    Parameter("reference.blends", [], "the same for each of the times; empty: as reference.blend", "s", 0.0, 1e3),
    Parameter(
        "reference.trim",
        "climbing",
        "equilibrium along a ramp: climbing, or static (level and unaccelerated)",
        choices=TRIMS,
    ),
)

COLUMNS = ("times", "altitudes", "velocities", "blends")
"""Names of what a corner has, in the plural: of parameters, after ``reference.``, and of the fields of a message."""

SUBSTEPS = 2
"""Runge-Kutta steps per period in phi_T, the default of the plant."""


class Corner(NamedTuple):
    """A point of the commands: time (s), altitude (m), velocity (m/s), half the time in which the rate changes (s)."""

    time: float
    altitude: float
    velocity: float
    blend: float


@dataclass(frozen=True, eq=False)
class ReferenceData(Data):
    """x_r (r, 9), u_r (r, 2), d_r (r, 9) as the core takes them; row 0 is that of step ``first``.

    The reference stands still before the first row and after the last.
    """

    KIND = "hsv_reference"
    first: int
    state: np.ndarray
    input: np.ndarray
    defect: np.ndarray

    def rows(self, chosen: np.ndarray | slice) -> ReferenceData:
        """Return the chosen rows, the first of which is that of step 0."""
        return ReferenceData(0, self.state[chosen], self.input[chosen], self.defect[chosen])


class ReferenceTrajectory:
    """x_r(k), u_r(k) and the defect d_r(k) of every step k, computed once; constant parts are stored once."""

    def __init__(
        self,
        times: Sequence[float],
        altitudes: Sequence[float],
        velocities: Sequence[float],
        period: float,
        rigid: VehicleParameters,
        trim: str = "climbing",
        blend: float | Sequence[float] = 0.0,
    ) -> None:
        """Trim the nominal decoupled vehicle at all points of the commands.

        Args:
            times: (b) in s, not decreasing; of two equal times the later value holds from there on.
            altitudes: (b) in m.
            velocities: (b) in m/s.
            period: Control period, s.
            rigid: Parameters of the nominal decoupled vehicle.
            trim: One of :data:`TRIMS`; ``"static"`` takes climb rate and acceleration of a ramp for zero.
            blend: Half the time in which the rate changes at a corner, s; one for all corners or one each (b).

        Raises:
            ParameterError: Arrays of different lengths, times that decrease, or commands that cannot be blended.
            TrimError: No equilibrium, or one outside the input limits; the time is named.
        """
        commands = _commands(times, altitudes, velocities)
        instants = _in_steps(np.asarray(times, float), period)
        blends = _blends(times, blend)
        half = blends / period
        first = max(0, math.ceil(instants[0] - half[0]) - 2)
        steps = np.arange(first, max(first, math.ceil(instants[-1] + half[-1])) + 1)
        command, slope = _evaluate(instants, commands, steps)
        bend = np.zeros(len(steps))
        if np.any(half):
            _blend(instants, commands, steps, half, command, slope, bend)
        # What a static trim does not know of.
        rate, bend = (slope / period, bend / (period * period)) if trim == "climbing" else (0.0 * slope, 0.0 * bend)
        rows = len(steps)
        self.data = ReferenceData(
            first, np.zeros((rows, N_STATES)), np.zeros((rows, N_INPUTS)), np.zeros((rows, N_STATES))
        )
        self._along = self.data.rows(slice(0))
        self.corners = tuple(map(Corner, *(map(float, column) for column in (times, altitudes, velocities, blends))))
        """The commands, one corner after the other."""
        size, inputs = np.full(rows, np.inf), self.data.input
        lib.hsv_reference_rows(
            vehicle_struct(rigid).pointer,
            rows,
            *map(doubles, map(vector, (command, rate, bend, INITIAL_GUESS))),
            period,
            SUBSTEPS,
            *map(doubles, (self.data.state, inputs, self.data.defect, size)),
        )
        good = (size < CONVERGED) & np.all((inputs >= rigid.input_minimum) & (inputs <= rigid.input_maximum), axis=1)
        for row in np.flatnonzero(~good)[:1]:
            climb, acceleration = rate[row]
            where = (
                f"reference at {steps[row] * period:.6g} s: altitude = {command[row, 0]:.6g} m, "
                f"velocity = {command[row, 1]:.6g} m/s, climb rate = {climb:.6g} m/s, "
                f"acceleration = {acceleration:.6g} m/s^2"
            )
            check_equilibrium(where, size[row], inputs[row], rigid)

    @classmethod
    def from_parameters(cls, values: Mapping[str, object], period: float) -> Self:
        """Build from :data:`REFERENCE_PARAMETERS` and the vehicle's for a control ``period`` (s); errors as above."""
        v = validate(REFERENCE_PARAMETERS, values)
        vehicle = Vehicle.from_parameters(values)
        vehicle.check_envelope(REFERENCE_PARAMETERS, v)
        times, altitudes, velocities = (v[f"reference.{name}"] for name in ("times", "altitudes", "velocities"))
        blend = v["reference.blends"] or v["reference.blend"]
        return cls(times, altitudes, velocities, period, vehicle.decoupled, v["reference.trim"], blend)

    @property
    def columns(self) -> dict[str, list[float]]:
        """Times (s), altitudes (m), velocities (m/s) and blends (s) of the corners, as :data:`REFERENCE_PARAMETERS`."""
        columns = zip(*self.corners, strict=True)
        return {name: list(column) for name, column in zip(COLUMNS, columns, strict=True)}

    def row(self, step: int) -> int:
        """Return the row of :attr:`data` that holds ``step``."""
        return min(max(step - self.data.first, 0), len(self.data.state) - 1)

    def rows(self, steps: int) -> np.ndarray:
        """Return the rows of the first ``steps`` steps."""
        return np.clip(np.arange(steps) - self.data.first, 0, len(self.data.state) - 1)

    def along(self, steps: int) -> ReferenceData:
        """Return the rows of the first ``steps`` steps, one each; they are shared by all who ask."""
        along = self._along
        if len(along.state) != steps:
            rows = self.rows(steps)
            self._along = along = self.data.rows(rows)
        return along

    @property
    def final_state(self) -> np.ndarray:
        """x_r (9) after the last command."""
        return np.asarray(self.data.state[-1])


def _commands(times: Sequence[float], altitudes: Sequence[float], velocities: Sequence[float]) -> np.ndarray:
    if not len(times):
        raise ParameterError("parameter reference.times: empty, expected at least one time")
    for name, column in (("altitudes", altitudes), ("velocities", velocities)):
        if len(column) != len(times):
            raise ParameterError(
                f"parameter reference.{name}: {len(column)} values, expected as many as reference.times, {len(times)}"
            )
    for index, (before, after) in enumerate(itertools.pairwise(times), start=1):
        if after < before:
            raise ParameterError(f"parameter reference.times[{index}] = {after:g}: expected at least {before:g}")
    return np.column_stack((np.asarray(altitudes, float), np.asarray(velocities, float)))


def _blends(times: Sequence[float], blend: float | Sequence[float]) -> np.ndarray:
    """Return the blend of each corner (b), s.

    Raises:
        ParameterError: Blends of another length, of a step, or one that would begin before the flight.
    """
    if isinstance(blend, Sequence) and len(blend) != len(times):
        raise ParameterError(
            f"parameter reference.blends: {len(blend)} values, expected as many as reference.times, {len(times)}"
        )
    blends = np.zeros(len(times))
    if len(times) > 1:
        blends[:] = blend
    for index, (time, half) in enumerate(zip(times, blends.tolist(), strict=True)):
        name = f"reference.blends[{index}]" if isinstance(blend, Sequence) else "reference.blend"
        where = f"parameter {name} = {half:g}"
        if half > time:
            raise ParameterError(f"{where}: expected at most the time of the command, {time:g} s")
        if half > 0.0 and time in (*times[:index][-1:], *times[index + 1 :][:1]):
            raise ParameterError(f"{where}: expected 0 with a step, as at {time:g} s, or a ramp in its place")
    return blends


def _blend(
    instants: np.ndarray,
    commands: np.ndarray,
    steps: np.ndarray,
    half: np.ndarray,
    command: np.ndarray,
    slope: np.ndarray,
    bend: np.ndarray,
) -> None:
    """Average ``command`` (r, 2) and ``slope`` (r, 2) about every corner; ``half`` (b) its triangle's width, steps.

    To ``bend`` (r), add the change of the first slope per step.
    """
    before = np.zeros(commands.shape[1])
    for index in range(len(instants)):
        after = np.zeros_like(before)
        if index + 1 < len(instants) and instants[index + 1] > instants[index]:
            after = (commands[index + 1] - commands[index]) / (instants[index + 1] - instants[index])
        change, width = after - before, half[index]
        before = after
        if width == 0.0:
            continue
        gone = steps - instants[index]
        left = np.maximum(width - np.abs(gone), 0.0)[:, None]
        command += change * (left * left * left / (6.0 * width * width))
        slope += np.where(gone[:, None] < 0.0, change, -change) * (left * left / (2.0 * width * width))
        bend += change[0] * (left[:, 0] / (width * width))


def _in_steps(times: np.ndarray, period: float) -> np.ndarray:
    """Return ``times`` (s) as step numbers; those that are whole but for the rounding of the division are whole."""
    steps = times / period
    whole = np.round(steps)
    return np.where(np.abs(steps - whole) < 1e-9 * np.maximum(1.0, whole), whole, steps)


def _evaluate(instants: np.ndarray, commands: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the commands (r, 2) at whole ``steps`` (r) and their change per step there, from the right."""
    piece = np.searchsorted(instants, steps, side="right") - 1
    start, stop = np.clip(piece, 0, None), np.clip(piece + 1, None, len(instants) - 1)
    length = instants[stop] - instants[start]
    inside = (piece >= 0) & (length > 0.0)
    slope = np.zeros((len(steps), commands.shape[1]))
    slope[inside] = (commands[stop] - commands[start])[inside] / length[inside, None]
    gone = np.where(inside, steps - instants[start], 0.0)
    return commands[start] + slope * gone[:, None], slope

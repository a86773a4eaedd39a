"""The reference of a flight: piecewise-linear commands of altitude and velocity, with the trim at every step.

On a ramp the reference state x_r is the climbing, accelerating trim of the nominal decoupled vehicle. Such a reference
moves with the dynamics of the vehicle: with phi_T, the flow of the nominal vehicle over one period, the next reference
state is phi_T(x_r(k), u_r(k)) except for the defect

    d_r(k) = phi_T(x_r(k), u_r(k)) - x_r(k+1).

The defect contains the jump of x_r where the commands jump and at a corner of a ramp. On a ramp it is small: the
difference between a sequence of trims and a solution of the equations of motion. If the reference is constant, the
defect is exactly zero. It drives the nominal system, x_n(k+1) = A(p) x_n + B(p) u_n + d_r(k), with the model at
altitude and velocity p. With x_r(k) - x_r(k+1) in place of d_r, the climb itself, about 6 cm per period, would be a
disturbance; that form is right for static trims only, for which phi_T(x_r, u_r) = x_r.

Corners can be blended: the piecewise-linear commands are averaged over time by a triangle of half-width w. Within w of
a corner at which the rate changes by s, this adds s (w - |t|)^3 / (6 w^2), with t the time from the corner. The rate
and the acceleration are then continuous; the acceleration is at most s / w and the jerk at most s / w^2. The flight
path turns there, and x_r is the trim of a steady pull-up with q_r = h'' / (V cos gamma), the rate of the flight-path
angle. With trims at q_r = 0 the defect would have to contain the whole turn.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, check_lengths, validate
from hsv.core import Struct, doubles, ffi, lib, vector
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
"""Columns of a list of corners, named as the parameters after ``reference.`` and as the fields of the message."""

SUBSTEPS = 2
"""Runge-Kutta steps per period in phi_T; the plant has the same default."""


class Corner(NamedTuple):
    """A corner of the commands: its time (s), altitude (m), velocity (m/s) and the half-width (s) of its blend."""

    time: float
    altitude: float
    velocity: float
    blend: float


class ReferenceTrajectory:
    """The reference x_r(k), u_r(k) and its defect d_r(k) for every step k, computed once.

    The constant parts before the first and after the last corner are not stored step by step.
    """

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
        """Trim the nominal decoupled vehicle at every step of the commands.

        Args:
            times: (b) times of the corners, s, not decreasing; two equal times define a jump to the later value.
            altitudes: (b) m.
            velocities: (b) m/s.
            period: Control period, s.
            rigid: Parameters of the nominal decoupled vehicle.
            trim: One of :data:`TRIMS`; ``"static"`` sets climb rate and acceleration on a ramp to zero.
            blend: Half-width of the blend, s; one value for all corners, or one for each (b).

        Raises:
            ParameterError: The arrays have different lengths, times decrease, or the commands cannot be blended.
            TrimError: There is no equilibrium within the input limits at some step; the message names the time.
        """
        _check_commands(times, altitudes, velocities)
        corners = vector(np.column_stack((times, altitudes, velocities, _blends(times, blend))))
        start = ffi.new("int64_t *")
        rows = lib.hsv_reference_steps(len(corners), doubles(corners), period, start)
        first = int(start[0])
        command, rate, bend = np.empty((rows, 2)), np.empty((rows, 2)), np.empty(rows)
        moving = map(doubles, (command, rate, bend))
        lib.hsv_commands(len(corners), doubles(corners), period, trim == "climbing", first, rows, *moving)
        arrays = {name: np.zeros((rows, N_STATES)) for name in ("state", "defect")}
        self.data = Struct("hsv_reference", first=first, input=np.zeros((rows, N_INPUTS)), **arrays)
        """x_r (r, 9), u_r (r, 2), d_r (r, 9) from step ``first`` on; steps before and after equal the nearest row."""
        self._along: Struct | None = None
        self.corners = tuple(Corner(*corner) for corner in corners.tolist())
        """The corners of the commands in order of time."""
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
                f"reference at {(first + row) * period:.6g} s: altitude = {command[row, 0]:.6g} m, "
                f"velocity = {command[row, 1]:.6g} m/s, climb rate = {climb:.6g} m/s, "
                f"acceleration = {acceleration:.6g} m/s^2"
            )
            check_equilibrium(where, size[row], inputs[row], rigid)

    @classmethod
    def from_parameters(cls, values: Mapping[str, object], period: float) -> Self:
        """Build the reference from :data:`REFERENCE_PARAMETERS` and the parameters of the vehicle.

        Args:
            values: Flat parameters.
            period: Control period, s.
        """
        v = validate(REFERENCE_PARAMETERS, values)
        vehicle = Vehicle.from_parameters(values)
        vehicle.check_envelope(REFERENCE_PARAMETERS, v)
        times, altitudes, velocities = (v[f"reference.{name}"] for name in ("times", "altitudes", "velocities"))
        blend = v["reference.blends"] or v["reference.blend"]
        return cls(times, altitudes, velocities, period, vehicle.decoupled, v["reference.trim"], blend)

    @property
    def columns(self) -> dict[str, list[float]]:
        """Corners by column, see :data:`COLUMNS`: times (s), altitudes (m), velocities (m/s) and blends (s)."""
        columns = zip(*self.corners, strict=True)
        return {name: list(column) for name, column in zip(COLUMNS, columns, strict=True)}

    def row(self, step: int) -> int:
        """Return the index of the row of :attr:`data` for ``step``."""
        return min(max(step - self.data.first, 0), len(self.data.state) - 1)

    def rows(self, steps: int) -> np.ndarray:
        """Return the index of the row of :attr:`data` for each of the first ``steps`` steps, an array (steps)."""
        return np.clip(np.arange(steps) - self.data.first, 0, len(self.data.state) - 1)

    def along(self, steps: int) -> Struct:
        """Return :attr:`data` with one row for each of the first ``steps`` steps; it is cached, do not change it."""
        along = self._along
        if along is None or len(along.state) != steps:
            arrays = {name: getattr(self.data, name)[self.rows(steps)] for name in ("state", "input", "defect")}
            # Another thread may need another length, so return this one and not the attribute.
            self._along = along = Struct("hsv_reference", first=0, **arrays)
        return along

    @property
    def end(self) -> float:
        """Time from which the reference is constant, s."""
        return self.corners[-1].time + self.corners[-1].blend

    @property
    def final_state(self) -> np.ndarray:
        """x_r (9) after the last command."""
        return np.asarray(self.data.state[-1])


def _check_commands(times: Sequence[float], altitudes: Sequence[float], velocities: Sequence[float]) -> None:
    if not len(times):
        raise ParameterError("parameter reference.times: empty, expected at least one time")
    columns = {"reference.times": times, "reference.altitudes": altitudes, "reference.velocities": velocities}
    check_lengths(columns, *columns)
    for index, (before, after) in enumerate(itertools.pairwise(times), start=1):
        if after < before:
            raise ParameterError(f"parameter reference.times[{index}] = {after:g}: expected at least {before:g}")


def _blends(times: Sequence[float], blend: float | Sequence[float]) -> np.ndarray:
    """Return the half-width (s) of each corner's blend, shape (b,) as ``times``; zero if there is only one corner.

    Raises:
        ParameterError: A blend begins before time 0 or lies at a jump, or there is not one for each time.
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

"""The largest gust that a controller tolerates, by root finding over its velocity in simulated flights.

Level flight at the end of Case 1's step with its fault, the nominal vehicle behind an elevator of 50 rad/s with its
limits, including stops that are closer than the vehicle's. The transient of the fault has ended before the gust.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from hsv.base.units import FOOT, to_paper
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.tables import breakpoints
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.plant import FlightStatus
from hsv.model.signals import STATE_NAMES
from hsv_paper.linear_loop import ELEVATOR, TARGET, stability_limit
from hsv_paper.sensitivity.controllers import Controller

FUEL, SURFACE = "fuel_10", "elevator_50"
"""Names of the actuators."""

STOP = ACTUATOR_SETS[SURFACE].stop
"""rad"""


@dataclass(frozen=True)
class Shape:
    """A 1 - cos gust that builds up over ``length`` (m), and then stays or decays over the same length."""

    length: float
    stays: bool

    @property
    def key(self) -> str:
        """Name in the results of a study."""
        return f"1 - cos over {self.length / FOOT:g} ft that {'stays' if self.stays else 'falls as it rose'}"

    @property
    def said(self) -> str:
        """Description in words."""
        after = "persists" if self.stays else "decays in the same way"
        return f"1 - cos gust that builds up over {self.length / FOOT:g} ft and then {after}"


SHAPES = (Shape(350.0 * FOOT, False), Shape(1750.0 * FOOT, True))
"""The longest of CS-25.341, and that of MIL-F-8785C with the length of turbulence up here."""

HALF_DEGREE = float(np.radians(0.5))
"""rad: the paper's largest allowable error of the attitude angles (5.1)."""

VELOCITIES = tuple(np.linspace(0.0, 100.0, 9)[1:].tolist())
"""m/s, up to the largest that a scenario may have; the grid in which limits are bracketed."""

_START, _END = 30.0, 50.0
"""s: when the gust begins and the flight ends."""

_ATTITUDE = [STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")]


class Answer(NamedTuple):
    """Response to a gust: largest change of an attitude angle and largest |elevator command| (rad), flight lost or not.

    The command is the one before saturation.
    """

    attitude: float
    elevator: float
    lost: bool


@dataclass(frozen=True)
class GustLimits:
    """Velocities (m/s), of the worse of both directions; ``None``: not up to the last of :data:`VELOCITIES`.

    ``attitude``: an attitude angle changes by half a degree; ``elevator``: its command exceeds its stop; ``lost``: the
    flight is lost.
    """

    attitude: float | None
    elevator: float | None
    lost: float | None

    @property
    def said(self) -> str:
        """Description in words."""
        limits = (
            (self.attitude, "the attitude changes by half a degree", "the attitude changes by less than half a degree"),
            (self.elevator, "the elevator reaches its stop", "the elevator does not reach its stop"),
            (self.lost, "the flight is lost", "the flight is not lost"),
        )
        if all(value is None for value, *_ in limits):
            return f"no limit is reached up to {_velocity(VELOCITIES[-1])}"
        parts = [f"{what} from {_velocity(value)} on" for value, what, _ in limits if value is not None]
        parts += [f"{otherwise} up to {_velocity(VELOCITIES[-1])}" for value, _, otherwise in limits if value is None]
        return f"{', '.join(parts[:-1])}, and {parts[-1]}"


def _velocity(value: float) -> str:
    number, unit = to_paper(value, "m/s")
    return f"{number:.0f} {unit}"


@cache
def answer(controller: Controller, coupling: str, shape: Shape, up: float) -> Answer:
    """Return the response of a controller's flight to a gust of velocity ``up`` (m/s) with this coupling."""
    altitude, velocity = TARGET
    values = controller.parameters()
    own = {f"reference.{name}": list(column) for name, column in breakpoints(altitude, velocity, ())._asdict().items()}
    values |= own | {
        "vehicle.model": "CM",
        "vehicle.coupling": coupling,
        "initial.altitude": altitude,
        "initial.velocity": velocity,
        "duration": _END,
        "fault.starts": [0.0],
        "actuator.fuel_equivalence_ratio.set": FUEL,
        "actuator.elevator_deflection.set": SURFACE,
        "gust.starts": [_START],
        "gust.up": [up],
        "gust.lengths": [shape.length],
        "gust.stays": [float(shape.stays)],
    }
    flight = fly(assemble(values))
    first = round(_START / flight.period)
    attitude = flight.history.state[first:, _ATTITUDE]
    return Answer(
        float(np.abs(attitude - attitude[0]).max()),
        float(np.abs(flight.history.u_unsaturated[first:, ELEVATOR]).max()),
        flight.status is FlightStatus.DIVERGED,
    )


def worse(controller: Controller, coupling: str, shape: Shape, velocity: float) -> Answer:
    """Return the largest numbers of a gust of this ``velocity`` (m/s) from below and from above."""
    up, down = (answer(controller, coupling, shape, sign * velocity) for sign in (1.0, -1.0))
    return Answer(max(up.attitude, down.attitude), max(up.elevator, down.elevator), up.lost or down.lost)


def gust_limits(controller: Controller, coupling: str, shape: Shape) -> GustLimits:
    """Return the limits of a controller with this coupling in gusts of this shape."""
    beyond: dict[str, Callable[[Answer], float]] = {
        "attitude": lambda found: found.attitude / HALF_DEGREE - 1.0,
        "elevator": lambda found: found.elevator / STOP - 1.0,
        "lost": lambda found: 1.0 if found.lost else -1.0,
    }

    def limit(excess: Callable[[Answer], float]) -> float | None:
        # Beginning in still air, because the first of the velocities may already be beyond a limit.
        return stability_limit(lambda v: excess(worse(controller, coupling, shape, v)), (0.0, *VELOCITIES), 1e-3)

    return GustLimits(**{name: limit(excess) for name, excess in beyond.items()})

"""Limits of each controller: actuators, delay and sensor noise of its linear loop, and the gust of its flight.

Gusts are flown in level flight at the end of Case 1's step with its fault, the nominal vehicle behind an elevator of 50
rad/s with its limits, including stops that are closer than the vehicle's. The transient of the fault has ended before
the gust.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from hsv.base.units import FOOT
from hsv.flight.assembly import assemble
from hsv.flight.closed_loop import fly
from hsv.flight.tables import breakpoints
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.plant import FlightStatus
from hsv.model.sensors import SENSOR_SETS
from hsv.model.signals import STATE_NAMES
from hsv.model.vehicle import load_vehicle
from hsv_paper.linear_loop import (
    ELEVATOR,
    NOMINAL,
    START,
    TARGET,
    Corners,
    Feedback,
    Hardware,
    crossings,
    stability_limit,
)
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, GREY, ORANGE, PURPLE, RED, ZERO, letter, new_figure
from hsv_paper.sensitivity.sweep import RMPC_GAIN, WIDER_NOTCH, WITH_NOTCH, WITHOUT_NOTCH, Controller, feedback
from hsv_paper.study import Outcome, Scope, in_words, rounded

REALISTIC = Controller("tube that knows its actuators", "case1", GREEN, "realistic")
RMPC = Controller("RMPC without notch", "case1_rmpc_fourth_k", RED)

FUEL, SURFACE = ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"]

ELEVATORS = {
    "ideal": Hardware(),
    "150 rad/s": Hardware((FUEL, ACTUATOR_SETS["elevator_150"])),
    "50 rad/s": Hardware((FUEL, SURFACE)),
    "20 rad/s, first order": Hardware((FUEL, ACTUATOR_SETS["elevator_first_order_20"])),
    "20 rad/s": Hardware((FUEL, ACTUATOR_SETS["elevator_20"])),
}
"""Published elevators, each but the ideal one with the fuel delivery of 10 rad/s."""

BANDWIDTHS = tuple(np.geomspace(3.0, 2000.0, 61).tolist())
"""rad/s, of elevators of the second order."""

DELAYS = tuple(np.arange(0.0, 0.3001, 0.01).tolist())
"""s, in which the limit is bracketed."""

VELOCITIES = tuple(np.linspace(0.0, 100.0, 9)[1:].tolist())
"""m/s, up to the largest that a scenario may have, in which limits of gusts are bracketed."""

HALF_DEGREE = float(np.radians(0.5))
"""rad: the paper's largest allowable error of the attitude angles (5.1)."""

_SHOWN_DELAY = 0.16
_GUST, _END = 30.0, 50.0
"""s: when the gust begins and the flight ends."""

_ATTITUDE = [STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")]


@dataclass(frozen=True)
class Case:
    """A controller around a vehicle with this coupling."""

    controller: Controller
    coupling: str
    color: str

    @property
    def label(self) -> str:
        """Label in plots and sentences."""
        return f"{self.controller.label}, {self.coupling.replace('_', '-')} coupling"

    def loop(self, hardware: Hardware) -> Feedback:
        """Return the linear loop with this hardware."""
        return replace(feedback(self.controller), hardware=hardware)

    def growth(self, hardware: Hardware, over: Corners = NOMINAL) -> float:
        """Return the largest real part (1/s) of all poles over both ends of the step, fault and corners."""
        return self.loop(hardware).growth(load_vehicle().coupled(self.coupling), over)

    def tolerated_delay(self, hardware: Hardware, over: Corners = NOMINAL) -> float | None:
        """Return the delay (s) at which the loop becomes unstable; ``None``: beyond all of :data:`DELAYS`."""
        return stability_limit(lambda delay: self.growth(replace(hardware, delay=delay), over), DELAYS)

    def elevator_noise(self, hardware: Hardware, sensors: str) -> float:
        """Return the rms elevator command (rad) from the noise of a sensor set, the worse end of the step.

        NaN where the loop is unstable.
        """
        channels = SENSOR_SETS[sensors].channels
        noise = np.array([channels.get(name, {}).get("noise", 0.0) for name in STATE_NAMES])
        vehicle = load_vehicle().coupled(self.coupling)
        loops = [self.loop(hardware).around(vehicle, point) for point in (START, TARGET)]
        if any(loop.growth >= 0.0 for loop in loops):
            return float("nan")
        return max(float(loop.command_noise(noise)[ELEVATOR]) for loop in loops)


CASES = (
    Case(WITH_NOTCH, "paper_like", BLUE),
    Case(WITHOUT_NOTCH, "paper_like", ORANGE),
    Case(REALISTIC, "paper_like", GREEN),
    Case(RMPC, "paper_like", RED),
    Case(WITH_NOTCH, "derived", PURPLE),
    Case(WIDER_NOTCH, "derived", GREY),
)


def elevator(bandwidth: float, delay: float = 0.0) -> Hardware:
    """Return the realistic elevator with another ``bandwidth`` (rad/s), its fuel delivery, and a ``delay`` (s)."""
    return Hardware((FUEL, replace(SURFACE, natural_frequency=bandwidth)), delay)


@dataclass(frozen=True)
class Gust:
    """A 1 - cos gust that builds up over ``length`` (m), and then stays or decays over the same length."""

    length: float
    stays: bool

    def __str__(self) -> str:
        after = "persists" if self.stays else "decays in the same way"
        return f"1 - cos gust that builds up over {self.length / FOOT:g} ft and then {after}"


GUSTS = (Gust(350.0 * FOOT, False), Gust(1750.0 * FOOT, True))
"""The longest of CS-25.341, and that of MIL-F-8785C with the length of turbulence at this altitude."""


class Response(NamedTuple):
    """Response to a gust: largest change of an attitude angle and largest unsaturated |elevator command| (rad)."""

    attitude: float
    elevator: float
    lost: bool


@cache
def response(case: Case, gust: Gust, up: float) -> Response:
    """Return the response of a flight to a gust of velocity ``up`` (m/s)."""
    altitude, velocity = TARGET
    level = breakpoints(altitude, velocity, ())._asdict()
    flight = fly(
        assemble(
            case.controller.parameters()
            | {f"reference.{name}": list(column) for name, column in level.items()}
            | {
                "vehicle.model": "CM",
                "vehicle.coupling": case.coupling,
                "initial.altitude": altitude,
                "initial.velocity": velocity,
                "duration": _END,
                "fault.starts": [0.0],
                "actuator.fuel_equivalence_ratio.set": "fuel_10",
                "actuator.elevator_deflection.set": "elevator_50",
                "gust.starts": [_GUST],
                "gust.up": [up],
                "gust.lengths": [gust.length],
                "gust.stays": [float(gust.stays)],
            }
        )
    )
    first = round(_GUST / flight.period)
    attitude = flight.history.state[first:, _ATTITUDE]
    return Response(
        float(np.abs(attitude - attitude[0]).max()),
        float(np.abs(flight.history.u_unsaturated[first:, ELEVATOR]).max()),
        flight.status is FlightStatus.DIVERGED,
    )


def worse(case: Case, gust: Gust, velocity: float) -> Response:
    """Return the largest numbers of a gust of this ``velocity`` (m/s) from below and from above."""
    up, down = (response(case, gust, sign * velocity) for sign in (1.0, -1.0))
    return Response(max(up.attitude, down.attitude), max(up.elevator, down.elevator), up.lost or down.lost)


def gust_limits(case: Case, gust: Gust) -> dict[str, float | None]:
    """Return the velocities (m/s) of a gust from which a controller exceeds its limits, ``None`` if it never does.

    ``attitude``: an attitude angle changes by half a degree; ``elevator``: its command exceeds its stop; ``lost``: the
    flight is lost.
    """

    def excess(name: str, velocity: float) -> float:
        found = worse(case, gust, velocity)
        if name == "lost":
            return 1.0 if found.lost else -1.0
        return found.attitude / HALF_DEGREE - 1.0 if name == "attitude" else found.elevator / SURFACE.stop - 1.0

    # Beginning in still air, because the first of the velocities may already be beyond a limit.
    velocities = (0.0, *VELOCITIES)
    return {name: stability_limit(partial(excess, name), velocities, 1e-3) for name in Response._fields}


def stability(case: Case, over: Corners) -> dict[str, Any]:
    """Return cells with the bandwidths at which a loop is stable, and its growth with each of :data:`ELEVATORS`."""
    sparse = BANDWIDTHS[:: max(1, len(BANDWIDTHS) // 30)]
    cells: dict[str, Any] = {"case": case.label}
    for which, vehicles, along in (("nominal", NOMINAL, BANDWIDTHS), ("worst", over, sparse)):
        growth = partial(_growth_at, case, vehicles)
        cells[f"stable with, rad/s, {which}"] = _spans(crossings(growth, along), growth(BANDWIDTHS[0]) < 0.0)
    return cells | {name: rounded(case.growth(hardware), 3) for name, hardware in ELEVATORS.items()}


def tolerances(case: Case, over: Corners) -> dict[str, Any]:
    """Return cells with the delays that a loop tolerates, and with its response to sensor noise at 50 rad/s."""
    cells: dict[str, Any] = {"case": case.label}
    for name in ("ideal", "50 rad/s"):
        for which, vehicles in (("nominal", NOMINAL), ("worst", over)):
            delay = case.tolerated_delay(ELEVATORS[name], vehicles)
            longest = f"≥ {1e3 * DELAYS[-1]:g}"
            cells[f"delay, ms, {name}, {which}"] = longest if delay is None else rounded(1e3 * delay)
    noise = {name: DEGREES * case.elevator_noise(ELEVATORS["50 rad/s"], name) for name in ("fine", "ghv")}
    cells |= {f"elevator rms, deg, {name} sensors": rounded(value, 2) for name, value in noise.items()}
    return cells | {"1 deg with noise of fine times": rounded(1.0 / noise["fine"], 1)}


def in_gusts(case: Case) -> dict[str, Any]:
    """Return cells with the velocities of both gusts (ft/s) from which a controller exceeds its limits."""
    heads = {"attitude": "half a degree of attitude", "elevator": "elevator at its stop", "lost": "lost"}
    return {"case": case.label} | {
        f"{heads[name]}, {gust.length / FOOT:g} ft": None if velocity is None else rounded(FEET * velocity)
        for gust in GUSTS
        for name, velocity in gust_limits(case, gust).items()
    }


def run(scope: Scope) -> Outcome:
    """Linearise every controller with elevators of all bandwidths and with delays, and fly it through gusts."""
    bandwidths = np.geomspace(5.0, 500.0, scope.count(31, 4)).tolist()
    delays = np.linspace(0.0, _SHOWN_DELAY, scope.count(33, 3)).tolist()
    velocities = VELOCITIES[:: scope.every]
    figure = new_figure(9.0)
    panels = figure.subplots(3, 2).ravel()
    tables: tuple[list[dict[str, Any]], ...] = ([], [], [])
    for done, case in enumerate(CASES):
        scope.progress("linear loops", done, len(CASES))
        borne = [case.tolerated_delay(elevator(w)) for w in bandwidths]
        gusts = [worse(case, GUSTS[-1], velocity) for velocity in velocities]
        style: Any = {"linestyle": "-" if case.coupling == "paper_like" else "--", "color": case.color}
        panels[0].semilogx(bandwidths, [case.growth(elevator(w)) for w in bandwidths], label=case.label, **style)
        late = [case.growth(elevator(SURFACE.natural_frequency, delay)) for delay in delays]
        panels[1].plot(1e3 * np.array(delays), late, **style)
        panels[2].semilogx(bandwidths, [np.nan if d is None else 1e3 * d for d in borne], **style)
        noise = [DEGREES * case.elevator_noise(elevator(w), "fine") for w in bandwidths]
        panels[3].semilogx(bandwidths, noise, **style)
        panels[4].plot(FEET * np.array(velocities), [DEGREES * one.attitude for one in gusts], **style)
        panels[5].plot(FEET * np.array(velocities), [DEGREES * one.elevator for one in gusts], **style)
        for table, row in zip(
            tables, (stability(case, scope.over), tolerances(case, scope.over), in_gusts(case)), strict=True
        ):
            table.append(row)
    scope.progress("linear loops", len(CASES), len(CASES))
    bandwidth, gust = "bandwidth of the elevator (rad/s)", "velocity of the gust (ft/s)"
    for panel, x, y, shown, limit in zip(
        panels,
        (bandwidth, f"delay (ms), elevator of {SURFACE.natural_frequency:g} rad/s", bandwidth, bandwidth, gust, gust),
        (
            "largest real part (1/s)",
            "largest real part (1/s)",
            "delay borne (ms)",
            "elevator rms, fine sensors (deg)",
            "largest change of attitude (deg)",
            "largest elevator command (deg)",
        ),
        ((-0.6, 1.0), (-0.6, 1.0), (0.0, None), (0.0, 1.0), (0.0, 5.0), (10.0, 30.0)),
        (0.0, 0.0, None, None, HALF_DEGREE, SURFACE.stop),
        strict=True,
    ):
        panel.set(xlabel=x, ylabel=y, ylim=shown)
        if limit is not None:
            panel.axhline(DEGREES * limit, **ZERO)
    letter(panels)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return Outcome(
        figure,
        "Linear sampled loop of Case 1 around the coupled nominal vehicle, with a second-order elevator (damping "
        f"{SURFACE.damping_ratio:g}) and the fuel delivery of {FUEL.natural_frequency:g} rad/s; each value is the "
        "worst over both ends of the step, before and after the fault. (a) Largest real part of the poles over the "
        "bandwidth of the elevator. (b) The same over a delay of the command. (c) Delay at which the loop becomes "
        "unstable, by root finding. (d) Rms elevator command due to the noise of the fine sensor set, without a "
        "fault; there is no line where the loop is unstable. The limits of the actuators are not included in (a) "
        f"to (d). (e), (f) Flight through a {GUSTS[-1]}, from below or from above, whichever is worse, at the end "
        f"of the step and after the fault, with an elevator of {SURFACE.natural_frequency:g} rad/s and its limits: "
        "(e) largest change of an attitude angle, with a line at half a degree, and (f) largest elevator command, "
        "with a line at the stop. The gust velocity at which an attitude angle changes by half a degree, the "
        "elevator command exceeds its stop, or the flight is lost is found by root finding over such flights. "
        f"{RMPC_GAIN}. *Worst* is the worst of {in_words(scope.over)}.",
        "Bandwidths of the elevator at which the loop is stable, and largest real part of the poles (1/s) with "
        "published elevators:",
        tables[0],
        "Tolerated delays with an ideal elevator and one of 50 rad/s, and the rms elevator command due to sensor "
        "noise with the latter (–: the loop is unstable):",
        tables[1],
        f"Velocities (ft/s) from which on a limit is reached, in a {GUSTS[0]}, and in a {GUSTS[1]} "
        f"(–: not up to {FEET * VELOCITIES[-1]:.0f} ft/s):",
        tables[2],
    )


def _growth_at(case: Case, over: Corners, bandwidth: float) -> float:
    return case.growth(elevator(bandwidth), over)


def _spans(changes: Sequence[float], first: bool) -> str:
    """Return the ranges in which a loop is stable: it changes at ``changes``; ``first``: stable at the lowest."""
    edges = [BANDWIDTHS[0], *changes, BANDWIDTHS[-1]]
    spans = [
        f"{low:.3g} to {high:.3g}" if high < BANDWIDTHS[-1] else f"from {low:.3g} on"
        for index, (low, high) in enumerate(pairwise(edges))
        if (index % 2 == 0) == first
    ]
    return ", ".join(spans) or "–"

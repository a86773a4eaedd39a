"""Limits of each controller: actuators, delay and sensor noise of its linear loop, and the gust of its flight.

Gusts are flown in level flight at the end of Case 1's step with its fault, the nominal vehicle behind an elevator of 50
rad/s with its limits, including stops that are closer than the vehicle's. The transient of the fault has ended before
the gust.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from hsv_paper.linear_loop import ELEVATOR, NOMINAL, START, TARGET, Corners, Hardware, crossings, stability_limit
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, GREY, ORANGE, PURPLE, RED, ZERO, letter, new_figure
from hsv_paper.sensitivity.sweep import RMPC, WIDER_NOTCH, WITH_NOTCH, WITHOUT_NOTCH, Controller
from hsv_paper.study import Outcome, Scope, in_words, rounded

FUEL, SURFACE = ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"]

ELEVATORS = {
    "ideal": Hardware.of("ideal"),
    "150 rad/s": Hardware.of("elevator_150"),
    "50 rad/s": Hardware.of("elevator_50"),
    "20 rad/s, first order": Hardware.of("elevator_first_order_20"),
    "20 rad/s": Hardware.of("elevator_20"),
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

_GUST, _END = 30.0, 50.0
"""s: when the gust begins and the flight ends."""

_ATTITUDE = [STATE_NAMES.index("angle_of_attack"), STATE_NAMES.index("pitch_angle")]

KNOWING = Controller("tube that knows its actuators", "case1", GREEN, "realistic")

CASES = tuple(
    replace(
        controller,
        label=f"{controller.label}, {coupling.replace('_', '-')} coupling",
        color=color,
        changes=(("vehicle.model", "CM"), ("vehicle.coupling", coupling)),
    )
    for controller, coupling, color in (
        (WITH_NOTCH, "paper_like", BLUE),
        (WITHOUT_NOTCH, "paper_like", ORANGE),
        (KNOWING, "paper_like", GREEN),
        (RMPC, "paper_like", RED),
        (WITH_NOTCH, "derived", PURPLE),
        (WIDER_NOTCH, "derived", GREY),
    )
)
"""Controllers with the coupling of their vehicle."""


def elevator(bandwidth: float, delay: float = 0.0) -> Hardware:
    """Return the realistic elevator with another ``bandwidth`` (rad/s), its fuel delivery, and a ``delay`` (s)."""
    return Hardware((FUEL, replace(SURFACE, natural_frequency=bandwidth)), delay)


def growth(case: Controller, hardware: Hardware, over: Corners = NOMINAL) -> float:
    """Return the largest real part (1/s) of all poles over both ends of the step, fault and corners."""
    return replace(case.loop, hardware=hardware).growth(case.vehicle, over)


def tolerated_delay(case: Controller, hardware: Hardware, over: Corners = NOMINAL) -> float | None:
    """Return the delay (s) at which the loop becomes unstable; ``None``: beyond all of :data:`DELAYS`."""
    return stability_limit(lambda delay: growth(case, replace(hardware, delay=delay), over), DELAYS)


def rms(case: Controller, hardware: Hardware, sensors: str) -> float:
    """Return the rms elevator command (rad) from the noise of a sensor set, the worse end of the step.

    NaN where the loop is unstable.
    """
    channels = SENSOR_SETS[sensors].channels
    noise = np.array([channels.get(name, {}).get("noise", 0.0) for name in STATE_NAMES])
    loops = [replace(case.loop, hardware=hardware).around(case.vehicle, point) for point in (START, TARGET)]
    if any(loop.growth >= 0.0 for loop in loops):
        return float("nan")
    return max(float(loop.command_noise(noise)[ELEVATOR]) for loop in loops)


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
def response(case: Controller, gust: Gust, up: float) -> Response:
    """Return the response of a flight to a gust of velocity ``up`` (m/s)."""
    altitude, velocity = TARGET
    level = breakpoints(altitude, velocity, ())._asdict()
    flight = fly(
        assemble(
            case.parameters()
            | {f"reference.{name}": list(column) for name, column in level.items()}
            | {
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


def worse(case: Controller, gust: Gust, velocity: float) -> Response:
    """Return the largest numbers of a gust of this ``velocity`` (m/s) from below and from above."""
    up, down = (response(case, gust, sign * velocity) for sign in (1.0, -1.0))
    return Response(max(up.attitude, down.attitude), max(up.elevator, down.elevator), up.lost or down.lost)


def gust_limits(case: Controller, gust: Gust) -> dict[str, float | None]:
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


def stability(case: Controller, over: Corners) -> dict[str, Any]:
    """Return cells with the bandwidths at which a loop is stable, and its growth with each of :data:`ELEVATORS`."""
    cells: dict[str, Any] = {"case": case.label}
    for which, vehicles, along in (("nominal", NOMINAL, BANDWIDTHS), ("worst", over, BANDWIDTHS[::2])):

        def at(bandwidth: float, vehicles: Corners = vehicles) -> float:
            return growth(case, elevator(bandwidth), vehicles)

        edges = [BANDWIDTHS[0], *crossings(at, along), BANDWIDTHS[-1]]
        spans = [
            f"{low:.3g} to {high:.3g}" if high < BANDWIDTHS[-1] else f"from {low:.3g} on"
            for low, high in list(pairwise(edges))[int(at(BANDWIDTHS[0]) >= 0.0) :: 2]
        ]
        cells[f"stable with, rad/s, {which}"] = ", ".join(spans) or "–"
    return cells | {name: rounded(growth(case, hardware), 3) for name, hardware in ELEVATORS.items()}


def tolerances(case: Controller, over: Corners) -> dict[str, Any]:
    """Return cells with the delays that a loop tolerates, and with its response to sensor noise at 50 rad/s."""
    cells: dict[str, Any] = {"case": case.label}
    for name in ("ideal", "50 rad/s"):
        for which, vehicles in (("nominal", NOMINAL), ("worst", over)):
            delay = tolerated_delay(case, ELEVATORS[name], vehicles)
            longest = f"≥ {1e3 * DELAYS[-1]:g}"
            cells[f"delay, ms, {name}, {which}"] = longest if delay is None else rounded(1e3 * delay)
    noise = {name: DEGREES * rms(case, ELEVATORS["50 rad/s"], name) for name in ("fine", "ghv")}
    cells |= {f"elevator rms, deg, {name} sensors": rounded(value, 2) for name, value in noise.items()}
    return cells | {"1 deg with noise of fine times": rounded(1.0 / noise["fine"], 1)}


def in_gusts(case: Controller) -> dict[str, Any]:
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
    delays = np.linspace(0.0, 0.16, scope.count(33, 3)).tolist()
    velocities = VELOCITIES[:: scope.every]
    figure = new_figure(9.0)
    axes = figure.subplots(3, 2).ravel()

    def draw(
        panel: int, of: Callable[[Controller, float], float], along: Sequence[float], factor: float, **labels: Any
    ) -> None:
        """Draw a function of every controller and of a value, shown times ``factor``, into a panel."""
        scope.progress("curves", panel, len(axes))
        for case in CASES:
            style: Any = {"linestyle": "--" if case.label.endswith("derived coupling") else "-", "color": case.color}
            x, y = factor * np.array(along), [of(case, value) for value in along]
            axes[panel].plot(x, y, label=case.label, **style)
        axes[panel].set(**labels)

    def borne(case: Controller, bandwidth: float) -> float:
        delay = tolerated_delay(case, elevator(bandwidth))
        return np.nan if delay is None else 1e3 * delay

    of_elevator: Any = {"xlabel": "bandwidth of the elevator (rad/s)", "xscale": "log"}
    of_delay: Any = {"xlabel": f"delay (ms), elevator of {SURFACE.natural_frequency:g} rad/s"}
    of_gust: Any = {"xlabel": "velocity of the gust (ft/s)"}
    part: Any = {"ylabel": "largest real part (1/s)", "ylim": (-0.6, 1.0)}
    noise: Any = {"ylabel": "elevator rms, fine sensors (deg)", "ylim": (0.0, 1.0)}
    change: Any = {"ylabel": "largest change of attitude (deg)", "ylim": (0.0, 5.0)}
    command: Any = {"ylabel": "largest elevator command (deg)", "ylim": (10.0, 30.0)}
    draw(0, lambda case, w: growth(case, elevator(w)), bandwidths, 1.0, **of_elevator, **part)
    draw(1, lambda case, d: growth(case, elevator(SURFACE.natural_frequency, d)), delays, 1e3, **of_delay, **part)
    draw(2, borne, bandwidths, 1.0, **of_elevator, ylabel="delay borne (ms)", ylim=(0.0, None))
    draw(3, lambda case, w: DEGREES * rms(case, elevator(w), "fine"), bandwidths, 1.0, **of_elevator, **noise)
    draw(4, lambda case, v: DEGREES * worse(case, GUSTS[-1], v).attitude, velocities, FEET, **of_gust, **change)
    draw(5, lambda case, v: DEGREES * worse(case, GUSTS[-1], v).elevator, velocities, FEET, **of_gust, **command)
    for panel, limit in ((0, 0.0), (1, 0.0), (4, HALF_DEGREE), (5, SURFACE.stop)):
        axes[panel].axhline(DEGREES * limit, **ZERO)
    letter(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return Outcome(
        figure,
        "Linear sampled loop of Case 1 around the coupled nominal vehicle, with a second-order elevator (damping "
        f"{SURFACE.damping_ratio:g}) and the fuel delivery of {FUEL.natural_frequency:g} rad/s. (a) Growth over the "
        "bandwidth of the elevator. (b) Growth over a delay of the command. (c) Delay at which the loop becomes "
        "unstable. (d) Rms elevator command due to the noise of the fine sensor set, without a fault; there is no line "
        "where the loop is unstable. The limits of the actuators are not included in (a) to (d). (e), (f) Flight "
        f"through a {GUSTS[-1]}, from below or from above, whichever is worse, at the end of the step and after the "
        f"fault, with an elevator of {SURFACE.natural_frequency:g} rad/s and its limits: (e) largest change of an "
        "attitude angle, with a line at half a degree, and (f) largest elevator command, with a line at the stop.",
        f"Bandwidths of the elevator at which the loop is stable, {in_words(scope.over)}, and growth of the nominal "
        "vehicle with published elevators:",
        [stability(case, scope.over) for case in CASES],
        "Tolerated delays with an ideal elevator and one of 50 rad/s, and the rms elevator command due to sensor "
        "noise with the latter (–: the loop is unstable):",
        [tolerances(case, scope.over) for case in CASES],
        f"Velocities (ft/s) from which on a limit is reached, by root finding over such flights, in a {GUSTS[0]}, and "
        f"in a {GUSTS[1]} (–: not up to {FEET * VELOCITIES[-1]:.0f} ft/s):",
        [in_gusts(case) for case in CASES],
    )

"""Limits of each controller's linear loop: bandwidth of the elevator, delay of the command, noise of the sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.sensors import SENSOR_SETS
from hsv.model.signals import STATE_NAMES
from hsv_paper.linear_loop import ELEVATOR, NOMINAL, START, TARGET, Corners, Hardware, crossings, stability_limit
from hsv_paper.plots import BLUE, DEGREES, GREEN, GREY, ORANGE, PURPLE, RED, ZERO, letter, new_figure
from hsv_paper.sensitivity.sweep import RMPC, WIDER_NOTCH, WITH_NOTCH, WITHOUT_NOTCH, Controller
from hsv_paper.study import Outcome, Scope, in_words, rounded

FUEL, SURFACE = ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"]

ELEVATORS = {"ideal": Hardware.of("ideal"), "50 rad/s": Hardware.of("elevator_50")}
"""Hardware for which tolerated delays are compared, by bandwidth of the elevator."""

BANDWIDTHS = tuple(np.geomspace(3.0, 2000.0, 61).tolist())
"""Bandwidths (rad/s) of second-order elevators, between which limits of stability are bracketed."""

DELAYS = tuple(np.arange(0.0, 0.3001, 0.01).tolist())
"""Delays (s) between which limits of stability are bracketed."""

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
"""The compared controllers, each with the coupling of its vehicle."""


def elevator(bandwidth: float, delay: float = 0.0) -> Hardware:
    """Return an elevator of this ``bandwidth`` (rad/s) with the 10 rad/s fuel delivery, and a ``delay`` (s)."""
    return Hardware((FUEL, replace(SURFACE, natural_frequency=bandwidth)), delay)


def growth(case: Controller, hardware: Hardware, over: Corners = NOMINAL) -> float:
    """Return the largest growth (1/s) of vehicles ``over`` at Case 1's start and target, before and after its fault."""
    return replace(case.loop, hardware=hardware).growth(case.vehicle, over)


def tolerated_delay(case: Controller, hardware: Hardware, over: Corners = NOMINAL) -> float | None:
    """Return the least delay (s) at which a loop of ``over`` is unstable; None if all are stable at :data:`DELAYS`."""
    return stability_limit(lambda delay: growth(case, replace(hardware, delay=delay), over), DELAYS)


def rms(case: Controller, hardware: Hardware, sensors: str) -> float:
    """Return the rms elevator command (rad) due to the noise of a set of sensors.

    It is the larger one of those at Case 1's start and target, without its fault; NaN if either loop is unstable.
    """
    channels = SENSOR_SETS[sensors].channels
    noise = np.array([channels.get(name, {}).get("noise", 0.0) for name in STATE_NAMES])
    loops = [replace(case.loop, hardware=hardware).around(case.vehicle, point) for point in (START, TARGET)]
    if any(loop.growth >= 0.0 for loop in loops):
        return float("nan")
    return max(float(loop.command_noise(noise)[ELEVATOR]) for loop in loops)


def stability(case: Controller, over: Corners) -> dict[str, Any]:
    """Return table cells: elevator bandwidths at which the nominal vehicle's loop, then all of ``over``, are stable."""
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
    return cells


def tolerances(case: Controller, over: Corners) -> dict[str, Any]:
    """Return table cells: tolerated delays, and the response to sensor noise with an elevator of 50 rad/s."""
    cells: dict[str, Any] = {"case": case.label}
    for name in ("ideal", "50 rad/s"):
        for which, vehicles in (("nominal", NOMINAL), ("worst", over)):
            delay = tolerated_delay(case, ELEVATORS[name], vehicles)
            longest = f"≥ {1e3 * DELAYS[-1]:g}"
            cells[f"delay, ms, {name}, {which}"] = longest if delay is None else rounded(1e3 * delay)
    noise = {name: DEGREES * rms(case, ELEVATORS["50 rad/s"], name) for name in ("fine", "ghv")}
    cells |= {f"elevator rms, deg, {name} sensors": rounded(value, 2) for name, value in noise.items()}
    return cells | {"1 deg with noise of fine times": rounded(1.0 / noise["fine"], 1)}


def run(scope: Scope) -> Outcome:
    """Compute the linear loop of every controller for elevators of different bandwidths and for delays."""
    bandwidths = np.geomspace(5.0, 500.0, scope.count(31, 4)).tolist()
    delays = np.linspace(0.0, 0.16, scope.count(33, 3)).tolist()
    figure = new_figure(6.4)
    axes = figure.subplots(2, 2).ravel()

    def borne(case: Controller, bandwidth: float) -> float:
        delay = tolerated_delay(case, elevator(bandwidth))
        return np.nan if delay is None else 1e3 * delay

    of_elevator: Any = {"xlabel": "bandwidth of the elevator (rad/s)", "xscale": "log"}
    of_delay: Any = {"xlabel": f"delay (ms), elevator of {SURFACE.natural_frequency:g} rad/s"}
    part: Any = {"ylabel": "largest real part (1/s)", "ylim": (-0.6, 1.0)}
    noise: Any = {"ylabel": "elevator rms, fine sensors (deg)", "ylim": (0.0, 1.0)}
    curves: Sequence[tuple[Callable[[Controller, float], float], list[float], float, dict[str, Any]]] = (
        (lambda case, w: growth(case, elevator(w)), bandwidths, 1.0, of_elevator | part),
        (lambda case, d: growth(case, elevator(SURFACE.natural_frequency, d)), delays, 1e3, of_delay | part),
        (borne, bandwidths, 1.0, of_elevator | {"ylabel": "delay borne (ms)", "ylim": (0.0, None)}),
        (lambda case, w: DEGREES * rms(case, elevator(w), "fine"), bandwidths, 1.0, of_elevator | noise),
    )
    for panel, (axis, (of, along, factor, labels)) in enumerate(zip(axes, curves, strict=True)):
        scope.progress("curves", panel, len(axes))
        for case in CASES:
            style: Any = {"linestyle": "--" if case.label.endswith("derived coupling") else "-", "color": case.color}
            axis.plot(factor * np.array(along), [of(case, value) for value in along], label=case.label, **style)
        axis.set(**labels)
    for axis in axes[:2]:
        axis.axhline(0.0, **ZERO)
    letter(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return Outcome(
        figure,
        "Linear sampled loop of Case 1 around the coupled nominal vehicle, with a second-order elevator (damping "
        f"{SURFACE.damping_ratio:g}) and the fuel delivery of {FUEL.natural_frequency:g} rad/s, without their limits. "
        "(a) Growth over the bandwidth of the elevator. (b) Growth over a delay of the command. (c) Delay at which the "
        "loop becomes unstable. (d) Rms elevator command due to the noise of the fine sensor set, without a fault; "
        "there is no line where the loop is unstable.",
        f"Bandwidths of the elevator at which the loop is stable, {in_words(scope.over)}:",
        [stability(case, scope.over) for case in CASES],
        "Tolerated delays with an ideal elevator and one of 50 rad/s, and the rms elevator command due to sensor "
        "noise with the latter (–: the loop is unstable):",
        [tolerances(case, scope.over) for case in CASES],
    )

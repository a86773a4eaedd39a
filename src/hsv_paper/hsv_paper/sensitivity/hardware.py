"""Limits of each controller: actuators, delay and sensor noise of its linear loop, and the gust of its flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.flight.corners import Corner
from hsv.model.actuators import ACTUATOR_SETS
from hsv.model.dynamics import VehicleParameters
from hsv.model.sensors import SENSOR_SETS
from hsv.model.signals import STATE_NAMES
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv_paper.linear_loop import START, TARGET, Hardware, crossings, sampled_loop, stability_limit, worst_growth
from hsv_paper.sensitivity.controllers import (
    PURPLE,
    SAID_RMPC,
    WIDER_NOTCH,
    WITH_NOTCH,
    WITHOUT_NOTCH,
    Controller,
    corners_of,
    feedback,
    said_corners,
)
from hsv_paper.sensitivity.gusts import HALF_DEGREE, SHAPES, STOP, VELOCITIES, gust_limits, worse
from hsv_paper.sensitivity.study import Outcome, Study

REALISTIC = Controller("tube that knows its actuators", "case1", GREEN, "realistic")
RMPC = Controller("RMPC without notch", "case1_rmpc_fourth_k", RED)


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


CASES = (
    Case(WITH_NOTCH, "paper_like", BLUE),
    Case(WITHOUT_NOTCH, "paper_like", ORANGE),
    Case(REALISTIC, "paper_like", GREEN),
    Case(RMPC, "paper_like", RED),
    Case(WITH_NOTCH, "derived", PURPLE),
    Case(WIDER_NOTCH, "derived", GREY),
)

FUEL, ELEVATOR = ACTUATOR_SETS["fuel_10"], ACTUATOR_SETS["elevator_50"]

ELEVATORS: dict[str, Hardware] = {
    "ideal actuators": Hardware(),
    "an elevator of 150 rad/s": Hardware((FUEL, ACTUATOR_SETS["elevator_150"])),
    "one of 50 rad/s": Hardware((FUEL, ELEVATOR)),
    "one of 20 rad/s, first order": Hardware((FUEL, ACTUATOR_SETS["elevator_first_order_20"])),
    "one of 20 rad/s": Hardware((FUEL, ACTUATOR_SETS["elevator_20"])),
}
"""Published elevators by their names in the results, each with the fuel delivery of 10 rad/s."""

_SAID = {name: name.replace("one of", "an elevator of") for name in ELEVATORS}
"""Their descriptions in words."""

BANDWIDTHS = tuple(np.geomspace(3.0, 2000.0, 61).tolist())
"""rad/s, of elevators of the second order."""

DELAYS = tuple(np.arange(0.0, 0.3001, 0.01).tolist())
"""s, the grid in which the limit is bracketed."""

_SHOWN_DELAY = 0.16

_SHOWN_GUST = SHAPES[-1]

_ONE_DEGREE = np.pi / 180.0


def elevator(bandwidth: float, delay: float = 0.0) -> Hardware:
    """Return the realistic elevator with another ``bandwidth`` (rad/s), its fuel delivery, and a ``delay`` (s)."""
    return Hardware((FUEL, replace(ELEVATOR, natural_frequency=bandwidth)), delay)


def growth(case: Case, hardware: Hardware, over: Sequence[Corner] = ({},)) -> float:
    """Return the largest real part (1/s) of all poles over both ends of the step, fault and corners."""
    gain, notch, period = feedback(case.controller)
    vehicle = load_vehicle().coupled(case.coupling)
    return max(worst_growth(vehicle.perturbed(corner), gain, notch, period, hardware) for corner in over)


def delay_borne(case: Case, hardware: Hardware, over: Sequence[Corner] = ({},)) -> float | None:
    """Return the delay (s) at which the loop becomes unstable; ``None``: beyond all of :data:`DELAYS`."""
    return stability_limit(lambda delay: growth(case, replace(hardware, delay=delay), over), DELAYS)


def elevator_noise(case: Case, hardware: Hardware, sensors: str) -> float:
    """Return the rms elevator command (rad) from the noise of a published sensor set, the worse end of the step.

    Not a number where the loop is unstable.
    """
    gain, notch, period = feedback(case.controller)
    vehicle: VehicleParameters = load_vehicle().coupled(case.coupling)
    channels = SENSOR_SETS[sensors].channels
    noise = np.array([channels.get(name, {}).get("noise", 0.0) for name in STATE_NAMES])
    loops = [sampled_loop(vehicle, gain, notch, period, point=p, hardware=hardware) for p in (START, TARGET)]
    if any(loop.growth >= 0.0 for loop in loops):
        return float("nan")
    return max(float(loop.command_noise(noise)[1]) for loop in loops)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Linearise every controller with elevators of all bandwidths and with delays."""
    over = corners_of(1.0, coarseness)
    bandwidths = np.geomspace(5.0, 500.0, max(4, round(31 / coarseness)))
    delays = np.linspace(0.0, _SHOWN_DELAY, max(3, round(33 / coarseness)))
    velocities = VELOCITIES[:: max(1, round(coarseness))]
    figure = new_figure(9.0)
    panels = figure.subplots(3, 2).ravel()
    findings, numbers = [], {}
    for done, case in enumerate(CASES):
        progress("linear loops", done, len(CASES))
        growths = [growth(case, elevator(float(w))) for w in bandwidths]
        late = [growth(case, elevator(ELEVATOR.natural_frequency, float(delay))) for delay in delays]
        borne = [delay_borne(case, elevator(float(w))) for w in bandwidths]
        noise = [elevator_noise(case, elevator(float(w)), "fine") for w in bandwidths]
        style = "-" if case.coupling == "paper_like" else "--"
        panels[0].semilogx(bandwidths, growths, style, color=case.color, label=case.label)
        panels[1].plot(1e3 * delays, late, style, color=case.color)
        panels[2].semilogx(bandwidths, [np.nan if d is None else 1e3 * d for d in borne], style, color=case.color)
        panels[3].semilogx(bandwidths, [to_paper(n, "rad")[0] for n in noise], style, color=case.color)
        in_gusts = [worse(case.controller, case.coupling, _SHOWN_GUST, velocity) for velocity in velocities]
        for panel, answers in zip(panels[4:], list(zip(*in_gusts, strict=True))[:2], strict=True):
            degrees = [to_paper(one, "rad")[0] for one in answers]
            panel.plot([to_paper(v, "m/s")[0] for v in velocities], degrees, style, color=case.color)
        limits = Limits.of(case, over)
        gusts = [gust_limits(case.controller, case.coupling, shape) for shape in SHAPES]
        in_words = "; ".join(f"in a {s.said}, {one.said}" for s, one in zip(SHAPES, gusts, strict=True))
        findings.append(f"{case.label}: {limits.said(said_corners(over))}; {in_words}")
        numbers[case.label] = {
            **limits.report(),
            "gust_limits_m_per_s": {s.key: vars(one) for s, one in zip(SHAPES, gusts, strict=True)},
            "in_gusts": [one._asdict() for one in in_gusts],
            "growth_per_s": growths,
            "growth_behind_delay_per_s": late,
            "delay_borne_s": borne,
            "elevator_noise_rad": noise,
        }
    progress("linear loops", len(CASES), len(CASES))
    for panel, label in zip(
        panels,
        (
            "largest real part (1/s)",
            "largest real part (1/s)",
            "delay borne (ms)",
            "elevator rms, fine sensors (deg)",
            "largest change of attitude (deg)",
            "largest elevator command (deg)",
        ),
        strict=True,
    ):
        panel.set_ylabel(label)
        panel.set_xlabel("bandwidth of the elevator (rad/s)")
    panels[1].set_xlabel(f"delay (ms), elevator of {ELEVATOR.natural_frequency:g} rad/s")
    for panel in panels[:2]:
        panel.axhline(0.0, color="black", linewidth=0.6)
        panel.set_ylim(-0.6, 1.0)
    panels[2].set_ylim(bottom=0.0)
    panels[3].set_ylim(0.0, 1.0)
    for panel, limit, shown in zip(panels[4:], (HALF_DEGREE, STOP), ((0.0, 5.0), (10.0, 30.0)), strict=True):
        panel.set_xlabel("velocity of the gust (ft/s)")
        panel.axhline(to_paper(limit, "rad")[0], color="black", linewidth=0.6)
        panel.set_ylim(*shown)
    letter(panels)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return Outcome(
        figure,
        "Linear sampled loop of Case 1 around the coupled nominal vehicle, with a second-order elevator (damping "
        f"{ELEVATOR.damping_ratio:g}) and the fuel delivery of {FUEL.natural_frequency:g} rad/s; each value is the "
        "worst over both ends of the step, before and after the fault. (a) Largest real part of the poles over the "
        "bandwidth of the elevator. (b) The same over a delay of the command. (c) Delay at which the loop becomes "
        "unstable, by root finding. (d) Rms elevator command due to the noise of the fine sensor set, without a fault; "
        "there is no line where the loop is unstable. The limits of the actuators are not included in (a) to (d). "
        f"(e), (f) Flight through a {_SHOWN_GUST.said}, from below or from above, whichever is worse, at the end of "
        f"the step and after the fault, with an elevator of {ELEVATOR.natural_frequency:g} rad/s and its limits: (e) "
        "largest change of an attitude angle, with a line at half a degree, and (f) largest elevator command, with a "
        "line at the stop. The gust velocity at which an attitude angle changes by half a degree, the elevator command "
        f"exceeds its stop, or the flight is lost is found by root finding over such flights. {SAID_RMPC}.",
        tuple(findings),
        {
            "bandwidth_rad_per_s": bandwidths.tolist(),
            "delay_s": delays.tolist(),
            "gust_m_per_s": list(velocities),
            "cases": numbers,
        },
    )


@dataclass(frozen=True)
class Limits:
    """Limits that a case tolerates.

    ``growths`` (1/s) with each of :data:`ELEVATORS`; ``bandwidths`` (rad/s) at which stability changes, of the nominal
    vehicle and of the worst of the corners; ``delays`` (s) with ideal and realistic actuators, nominal and worst;
    ``noise`` (rad) of the elevator by sensor set, realistic actuators.
    """

    growths: dict[str, float]
    bandwidths: tuple[list[float], list[float]]
    ends: tuple[bool, bool]
    delays: dict[str, tuple[float | None, float | None]]
    noise: dict[str, float]

    @classmethod
    def of(cls, case: Case, over: Sequence[Corner]) -> Limits:
        """Return the limits of ``case`` over the nominal vehicle and the corners ``over``."""

        def nominal(bandwidth: float) -> float:
            return growth(case, elevator(bandwidth))

        def worst(bandwidth: float) -> float:
            return growth(case, elevator(bandwidth), over)

        chosen = {name: ELEVATORS[name] for name in ("ideal actuators", "one of 50 rad/s")}
        return cls(
            {name: growth(case, hardware) for name, hardware in ELEVATORS.items()},
            (crossings(nominal, BANDWIDTHS), crossings(worst, BANDWIDTHS[:: max(1, len(BANDWIDTHS) // 30)])),
            (nominal(BANDWIDTHS[0]) < 0.0, worst(BANDWIDTHS[0]) < 0.0),
            {name: (delay_borne(case, h), delay_borne(case, h, over)) for name, h in chosen.items()},
            {name: elevator_noise(case, ELEVATORS["one of 50 rad/s"], name) for name in ("fine", "ghv")},
        )

    def said(self, corners: str) -> str:
        """Return the limits in words."""
        spans = [
            f"{_stable(changes, first)} ({vehicle})"
            for changes, first, vehicle in zip(
                self.bandwidths, self.ends, ("nominal vehicle", f"worst of {corners}"), strict=True
            )
        ]
        growths = ", ".join(f"{value:+.3f} with {_SAID[name]}" for name, value in self.growths.items())
        delays = "; ".join(
            f"with {_SAID[name]}, the tolerated delay is {_milliseconds(nominal)} (nominal vehicle) and "
            f"{_milliseconds(worst)} (worst corner)"
            for name, (nominal, worst) in self.delays.items()
        )
        return (
            f"over the bandwidth of the elevator, the loop is {' and '.join(spans)}; the largest real part of the "
            f"poles (1/s) is {growths}; {delays}; {self._said_noise()}"
        )

    def _said_noise(self) -> str:
        if any(np.isnan(value) for value in self.noise.values()):
            return "the response to sensor noise is undefined: the loop is unstable with an elevator of 50 rad/s"
        said = " and ".join(f"{to_paper(value, 'rad')[0]:.2f} deg ({name} set)" for name, value in self.noise.items())
        return (
            f"sensor noise causes an rms elevator command of {said}; it is 1 deg with "
            f"{_ONE_DEGREE / self.noise['fine']:.1f} times the noise of the fine set"
        )

    def report(self) -> dict[str, object]:
        """Return the limits for JSON."""
        return {
            "growth_with_published_elevators_per_s": self.growths,
            "stability_changes_at_rad_per_s": {"nominal": self.bandwidths[0], "worst": self.bandwidths[1]},
            "stable_when_slowest": {"nominal": self.ends[0], "worst": self.ends[1]},
            "delay_borne_s_of": {name: {"nominal": n, "worst": w} for name, (n, w) in self.delays.items()},
            "elevator_rms_rad": self.noise,
        }


def _stable(changes: Sequence[float], first: bool) -> str:
    """Return in words where a loop is stable: stability changes at ``changes``; ``first``: stable at the lowest."""
    edges = [BANDWIDTHS[0], *changes, BANDWIDTHS[-1]]
    spans = [
        f"from {low:.3g} to {high:.3g} rad/s" if high < BANDWIDTHS[-1] else f"from {low:.3g} rad/s on"
        for index, (low, high) in enumerate(pairwise(edges))
        if (index % 2 == 0) == first
    ]
    return f"stable {' and '.join(spans)}" if spans else "stable at no bandwidth"


def _milliseconds(delay: float | None) -> str:
    if delay is None:
        return f"at least {1e3 * DELAYS[-1]:g} ms"
    return f"{1e3 * delay:.0f} ms" if delay > 0.0 else "none"


STUDY = Study("hardware", "Actuators, delay, noise and gusts", run)

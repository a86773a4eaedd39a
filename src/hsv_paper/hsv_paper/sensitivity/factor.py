"""Benefit and cost of the adjustable factor tau, from 1 to the factor at which the loop is lost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.corners import Corner, fraction
from hsv.model.vehicle import load_vehicle
from hsv_paper.adjustable_factor import FACTORS, FINE, FactorStudy, factor_study
from hsv_paper.figures.style import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv_paper.sensitivity.controllers import corners_of, said_corners
from hsv_paper.sensitivity.study import Outcome, Study


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Design and fly at each factor; ``coarseness`` thins them out."""
    factors = FACTORS[:: max(1, round(coarseness))]
    over = corners_of(1.0, coarseness)
    done = factor_study(read_inputs(find_inputs("adjustable")), factors, over, progress)
    figure = new_figure(7.2)
    panels = figure.subplots(3, 2).ravel()
    tau = np.array([row.tau for row in done.rows])
    _draw_growth(panels[0], done)
    _draw_sets(panels[1], done, tau)
    room = np.array([row.room for row in done.rows])
    for column, name, color in ((0, "fuel equivalence ratio", ORANGE), (1, "elevator", BLUE)):
        panels[2].plot(tau, room[:, column] / room[0, column], "o-", color=color, markersize=3, label=name)
    panels[2].axhline(0.0, color="black", linewidth=0.6)
    panels[2].set_ylabel("room of the nominal input,\nshare of that at τ = 1")
    settling, ramp = np.array([row.settling for row in done.rows]), np.array([row.ramp for row in done.rows])
    for column, name, color in ((0, "altitude", GREEN), (1, "velocity", RED)):
        panels[3].plot(tau, settling[:, column], "o-", color=color, markersize=3, label=name)
        panels[4].plot(tau, ramp[:, column] / ramp[0, column], "o-", color=color, markersize=3, label=name)
    panels[3].set_ylabel("step settled (s)")
    panels[3].set_ylim(bottom=0.0)
    panels[4].set_ylabel("Case 2, error over time,\nshare of that at τ = 1")
    degrees = to_paper(1.0, "rad")[0]
    panels[5].plot(tau, [degrees * r.attitude for r in done.rows], "o-", color=BLUE, markersize=3, label="nominal")
    panels[5].plot(tau, [degrees * r.worst_attitude for r in done.rows], "o--", color=RED, markersize=3, label="worst")
    panels[5].axhline(0.5, color=GREY, linewidth=0.6, linestyle=":")
    panels[5].set_ylabel("attitude after the fault (deg)")
    panels[5].set_ylim(bottom=0.0)
    for panel in panels:
        panel.set_xlabel("τ")
        panel.set_xlim(1.02, FINE[0] if panel is panels[0] else min(factors) - 0.02)
        panel.legend(loc="best")
    letter(panels)
    return Outcome(
        figure,
        _shows(over),
        _findings(done, said_corners(over)),
        {
            "rows": [row.report() for row in done.rows],
            "stable_down_to": {name: {"nominal": n, "worst": w} for name, (n, w) in done.limits.items()},
        },
    )


def _shows(over: Sequence[Corner]) -> str:
    selection = said_corners(fraction(load_vehicle().uncertainty))
    return (
        "The adjustable design is computed and flown for each factor. (a) Largest real part of the poles of the linear "
        "sampled loop around the coupled vehicle, including the notch filter, over both ends of the step, before and "
        f"after the fault: nominal vehicle (solid), and the worst of {said_corners(over)} of the parameter bounds "
        "(dashed). Shaded: one Lyapunov function is found for the factor and all larger ones up to 1, over the "
        "vertices of the design's model, which does not include the coupling. (b) Half-width of the invariant set in "
        "velocity: Z' for the gain in use and W'(τ), the same for the full W, and the paper's τZ. (c) Range that "
        "remains for the nominal input about the target's trim, on the smaller side, relative to that at τ = 1 (eq. "
        "53). (d) Time until a step of +600 ft, +250 ft/s has settled to 2 % under K'(τ). (e) Case 2: integral of the "
        "error of altitude and velocity, nominal vehicle, relative to that at τ = 1. (f) Attitude deviation from "
        f"nominal after the fault: nominal vehicle, and the worst of {selection}, a different selection."
    )


def _draw_growth(panel: Axes, done: FactorStudy) -> None:
    panel.axvspan(done.least_certified, 1.0, color=GREEN, alpha=0.12, linewidth=0.0, label="one Lyapunov function")
    for (coupling, (nominal, worst)), color in zip(done.growth.items(), (BLUE, RED), strict=True):
        panel.plot(FINE, nominal, color=color, label=f"{coupling.replace('_', '-')} coupling")
        panel.plot(FINE, worst, "--", color=color, linewidth=0.9)
    panel.axhline(0.0, color="black", linewidth=0.6)
    panel.set_ylabel("largest real part (1/s)")


def _draw_sets(panel: Axes, done: FactorStudy, tau: np.ndarray) -> None:
    feet = to_paper(1.0, "m/s")[0]
    for name, color, label in (
        ("half_width", BLUE, "Z' for W'(τ)"),
        ("half_width_complete", RED, "Z' for W"),
        ("scaled", GREY, "τZ, the paper's"),
    ):
        panel.plot(tau, [feet * getattr(r, name)[1] for r in done.rows], "o-", color=color, markersize=3, label=label)
    panel.set_ylabel("half-width in velocity (ft/s)")
    panel.set_ylim(bottom=0.0)


def _findings(done: FactorStudy, linear: str) -> tuple[str, ...]:
    degrees, feet = to_paper(1.0, "rad")[0], to_paper(1.0, "m/s")[0]
    found = [
        f"one Lyapunov function is found for every factor from τ = {done.least_certified:.2f} to 1; "
        + "; ".join(
            f"with the {name.replace('_', '-')} coupling, the linear loop is stable {_stable(nominal)} (nominal "
            f"vehicle) and {_stable(worst)} (worst of {linear})"
            for name, (nominal, worst) in done.limits.items()
        )
    ]
    first = done.rows[0]
    for row in done.rows:
        settled = " and ".join(
            f"{value:.1f} s ({name})" for name, value in zip(("altitude", "velocity"), row.settling, strict=True)
        )
        room = " and ".join(f"{value:.2f}" for value in row.room / first.room)
        share = row.ramp / first.ramp
        found.append(
            f"at τ = {row.tau:g}, the half-width in velocity is {feet * row.half_width[1]:.1f} ft/s (Z') and "
            f"{feet * row.scaled[1]:.1f} ft/s (τZ); the range of the nominal input (fuel and elevator) is {room} times "
            f"that at τ = 1; the step settles in {settled}; the integral of the error in Case 2 is {share[0]:.2f} "
            f"(altitude) and {share[1]:.2f} (velocity) times that at τ = 1; the attitude deviation after the fault is "
            f"{degrees * row.attitude:.3f} deg (worst corner {degrees * row.worst_attitude:.3f} deg); the largest "
            f"errors at the end are {feet * row.worst_error[0]:.1f} ft and {feet * row.worst_error[1]:.1f} ft/s"
        )
    return (*found, _claim(done))


def _claim(done: FactorStudy) -> str:
    """Return what the flights show of the paper's claim that a smaller factor is faster but less robust (4.3)."""

    def compared(before: float, after: float, less: str, more: str) -> str:
        return less if after < before else more

    first, last = done.rows[0], done.rows[-1]
    velocity = compared(first.settling[1], last.settling[1], "settles sooner", "does not settle sooner")
    tau = [row.tau for row in done.rows[1:] if row.settling[0] > first.settling[0]]
    altitude = f"settles later at τ = {', '.join(f'{t:g}' for t in tau)}" if tau else "does not settle later"
    ramp = compared(first.ramp[1], last.ramp[1], "is followed more closely", "is followed less closely")
    attitude = compared(first.worst_attitude, last.worst_attitude, "moves less", "moves more")
    size = compared(first.half_width[1], last.half_width[1], "smaller", "larger, whereas τZ is smaller")
    return (
        f"the paper claims that a smaller factor is faster but less robust. From τ = {first.tau:g} to {last.tau:g}, "
        f"the velocity {velocity} after a step, because K' may use more of the inputs; the altitude {altitude}; the "
        f"ramp, on which the nominal input is hardly used, {ramp}; after the fault the attitude {attitude}; and the "
        f"set of the gain in flight is {size}"
    )


def _stable(limit: float | None) -> str:
    if limit is None:
        return f"down to at least τ = {FINE[0]:g}"
    return "not even at τ = 1" if limit == 1.0 else f"down to τ = {limit:.2f}"


STUDY = Study("factor", "Adjustable factor τ", run)

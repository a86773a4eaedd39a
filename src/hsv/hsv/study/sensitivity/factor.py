"""The adjustable factor tau: what it buys and what it costs, from 1 to where the loop is lost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from hsv.design.inputs import find_inputs, read_inputs
from hsv.design.region import Corner, fraction
from hsv.progress import Progress
from hsv.study.adjustable_factor import FACTORS, FINE, FactorStudy, factor_study
from hsv.study.figures.style import BLUE, GREEN, GREY, ORANGE, RED, letter, new_figure
from hsv.study.sensitivity.controllers import corners_of, said_corners
from hsv.study.sensitivity.study import Outcome, Study
from hsv.units import to_paper
from hsv.vehicle.vehicle import load_vehicle


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
        "The adjustable design made anew for each factor, and flown. (a) Rightmost pole of the linear sampled loop "
        "around the coupled vehicle, notch filter included, the worst of both ends of the step, before and after the "
        f"fault; nominal vehicle (solid), worst of {said_corners(over)} of the parameter bounds (dashed); shaded: one "
        "Lyapunov function is found for the factor and everything up to 1, over the vertices of the design's model, "
        "which knows no coupling. (b) Half-width of the invariant set in "
        "velocity: Z' for the gain in use and W'(τ), the same for the whole W, and the paper's τZ. (c) What is left "
        "for the nominal input about the target's trim, on the side with less of it, as a share of that at τ = 1 (eq. "
        "53). (d) Time until a step of +600 ft, +250 ft/s has settled to 2 % under K'(τ). (e) Case 2: integral of the "
        "error of altitude and velocity, nominal vehicle, as a share of that at τ = 1. (f) Attitude after the fault, "
        f"from nominal: nominal vehicle, and the worst of {selection}, another selection."
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
        f"one Lyapunov function for every factor from τ = {done.least_certified:.2f} to 1; the linear loop is stable "
        + ", ".join(
            f"{_stable(nominal)} (nominal vehicle) and {_stable(worst)} (worst of {linear}) with the "
            f"{name.replace('_', '-')} coupling"
            for name, (nominal, worst) in done.limits.items()
        )
    ]
    first = done.rows[0]
    for row in done.rows:
        settled = ", ".join(
            f"{name} {value:.1f} s" for name, value in zip(("altitude", "velocity"), row.settling, strict=True)
        )
        room = " and ".join(f"{value:.2f}" for value in row.room / first.room)
        share = row.ramp / first.ramp
        found.append(
            f"at τ = {row.tau:g}: Z' {feet * row.half_width[1]:.1f} ft/s, τZ {feet * row.scaled[1]:.1f} ft/s; room of "
            f"the nominal input (fuel and elevator) {room} of that at 1; step settled in {settled}; Case 2 error over "
            f"time {share[0]:.2f} (altitude) and {share[1]:.2f} (velocity) of that at 1; attitude after the fault "
            f"{degrees * row.attitude:.3f} deg, worst corner {degrees * row.worst_attitude:.3f} deg, its end "
            f"{feet * row.worst_error[0]:.1f} ft and {feet * row.worst_error[1]:.1f} ft/s off"
        )
    return (*found, _claim(done))


def _claim(done: FactorStudy) -> str:
    """Return what shows of the paper's claim that a smaller factor is faster and less robust (section 4.3)."""

    def compared(before: float, after: float, less: str, more: str) -> str:
        return less if after < before else more

    first, last = done.rows[0], done.rows[-1]
    velocity = compared(first.settling[1], last.settling[1], "settles sooner", "does not settle sooner")
    tau = [row.tau for row in done.rows[1:] if row.settling[0] > first.settling[0]]
    altitude = f"later at τ = {', '.join(f'{t:g}' for t in tau)}" if tau else "no later"
    ramp = compared(first.ramp[1], last.ramp[1], "is followed more closely", "is followed less closely")
    attitude = compared(first.worst_attitude, last.worst_attitude, "moves less", "moves more")
    size = compared(first.half_width[1], last.half_width[1], "smaller", "larger, not smaller as τZ is")
    return (
        f"of the paper's claim, from τ = {first.tau:g} to {last.tau:g}: the velocity {velocity} after a step, because "
        f"K' may use more of the inputs, altitude {altitude}; the ramp, on which the nominal input has nothing to "
        f"do, {ramp}; after the "
        f"fault the attitude {attitude}; the set of the gain that flies is {size}"
    )


def _stable(limit: float | None) -> str:
    if limit is None:
        return f"down to τ = {FINE[0]:g} at least"
    return "not even at τ = 1" if limit == 1.0 else f"down to τ = {limit:.2f}"


STUDY = Study("factor", "Adjustable factor τ", run)

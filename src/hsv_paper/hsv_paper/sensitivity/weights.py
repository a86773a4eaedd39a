"""The weights of F and K and the input bounds of K, which the paper leaves open."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from hsv.base.processes import Progress
from hsv.base.units import to_paper
from hsv.flight.corners import Corner
from hsv.flight.scenario import load_scenario
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import letter, new_figure
from hsv_paper.linear_loop import stability_limit, worst_growth
from hsv_paper.sensitivity.controllers import (
    RMPC_DECOUPLED,
    WITH_NOTCH,
    WITHOUT_NOTCH,
    Controller,
    corners_of,
    said_corners,
)
from hsv_paper.sensitivity.study import Outcome, Study
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_result import SweepResult
from hsv_paper.sensitivity.variations import (
    BOUNDS,
    ELEVATOR,
    FACTORS,
    WEIGHTS,
    Group,
    Variations,
    baseline_variations,
)

Results = dict[Group, SweepResult]


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Design F and K with each group of weights times each factor, linearise and fly Case 1 with them."""
    varied, over = baseline_variations(), corners_of(1.0, coarseness)
    every = 1 if coarseness < 2.0 else 2
    factors = {"F": FACTORS[::every], "K": FACTORS[::2]}
    designs = varied.design(factors, progress)
    growths = {
        notched: {
            group: [_growth(varied, designs["F", group, f].feedback_gain, notched, over) for f in factors["F"]]
            for group in WEIGHTS
        }
        for notched in (True, False)
    }

    def flown(law: str, groups: tuple[Group, ...], controller: Controller) -> Results:
        along = {
            Controller(group.label, controller.scenario, group.color): [
                Point(
                    {**designs[law, group, f].to_parameters(), **load_scenario(controller.scenario).parameters()}, over
                )
                for f in factors[law]
            ]
            for group in groups
        }
        results = sweep(f"weights_{law}_{controller.scenario}", along, folder, progress)
        return dict(zip(groups, results.values(), strict=True))

    of_F = flown("F", WEIGHTS, WITH_NOTCH)
    of_K = flown("K", (*WEIGHTS, BOUNDS), WITH_NOTCH)
    of_rmpc = flown("K", (*WEIGHTS, BOUNDS), RMPC_DECOUPLED)
    limits = _elevator_limits(varied, over)
    figure = new_figure(7.6)
    _draw(figure, factors, growths, (of_F, of_K, of_rmpc))
    return Outcome(
        figure,
        "The baseline with one group of its scales or input bounds multiplied by a factor (1 is the baseline itself; a "
        "weight is one over the square of its scale, so that a larger scale is a smaller weight). The left panels vary "
        "F, the right panels K with its input bounds; everything else is unchanged. The flights are those of Case 1 "
        f"with the paper-like coupling, for the nominal vehicle and {said_corners(over)} of the parameter bounds. (a) "
        "Largest real part of the poles of the linear sampled loop, over all vehicles and both ends of the step, "
        "before and after the fault; with notch (solid) and without (dashed). (b) Time until altitude (solid) and "
        "velocity (dashed) have settled to 2 % of the step, nominal vehicle; a line ends where they do not settle "
        "before the fault. (c), (d) Attitude deviation from nominal after the fault, worst corner; the black line is "
        "half a degree. (e) Altitude error at the end, nominal vehicle (solid) and worst corner (dashed). (f) The same "
        "error with robust MPC and the fourth gain, as the paper flies it: on the decoupled model, without notch; a "
        "dashed line ends where a flight is lost.",
        (
            *_feedback_findings(factors["F"], of_F, growths[False]),
            *limits,
            *_nominal_findings(factors["K"], of_K, of_rmpc),
        ),
        {
            "factor": {law: list(values) for law, values in factors.items()},
            "growth_per_s": {
                "with notch" if notched else "without": {group.label: values for group, values in rows.items()}
                for notched, rows in growths.items()
            },
            "flights": {
                name: {group.label: columns for group, columns in results.items()}
                for name, results in (("F", of_F), ("K", of_K), ("K, RMPC", of_rmpc))
            },
        },
    )


def _growth(varied: Variations, gain: np.ndarray, notched: bool, over: list[Corner]) -> float:
    vehicle, notch = load_vehicle().coupled("paper_like"), varied.flown.notch if notched else ()
    return max(worst_growth(vehicle.perturbed(corner), gain, notch, varied.flown.period) for corner in over)


def _elevator_limits(varied: Variations, over: list[Corner]) -> list[str]:
    """Return in words the scale of the elevator in F up to which the linear loops are stable."""
    own = varied.inputs.feedback.input_scale.elevator_deflection

    @cache
    def gain(factor: float) -> np.ndarray:
        return varied.feedback(ELEVATOR, factor).feedback_gain

    def limit(notched: bool, vehicles: list[Corner]) -> str:
        found = stability_limit(lambda factor: _growth(varied, gain(factor), notched, vehicles), FACTORS)
        return "at every factor" if found is None else f"up to {found * own:.3f} rad"

    return [
        f"{controller.label}, scale of the elevator in F ({own:g} rad in the baseline): the linear loop is stable "
        f"{limit(notched, over[:1])} (nominal vehicle) and {limit(notched, over)} (worst of {said_corners(over)})"
        for controller, notched in ((WITH_NOTCH, True), (WITHOUT_NOTCH, False))
    ]


def _draw(
    figure: Figure,
    factors: dict[str, tuple[float, ...]],
    growths: dict[bool, dict[Group, list[float]]],
    flights: tuple[Results, Results, Results],
) -> None:
    of_F, of_K, of_rmpc = flights
    panels = figure.subplots(3, 2, sharex=True)
    feet, degrees = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]
    for notched, rows in growths.items():
        for group, values in rows.items():
            panels[0, 0].plot(factors["F"], values, "o-" if notched else "o--", color=group.color, markersize=3)
    panels[0, 0].axhline(0.0, color="black", linewidth=0.6)
    panels[0, 0].set_ylabel("largest real part (1/s)")
    ends = ("altitude_end_error_nominal", "altitude_end_error_worst")
    settling = ("altitude_settling_time_nominal", "velocity_settling_time_nominal")
    attitude = ("post_fault_attitude_from_nominal_worst",)
    for axis, law, results, names, unit, label in (
        (panels[0, 1], "K", of_K, settling, 1.0, "step settled (s)"),
        (panels[1, 0], "F", of_F, attitude, degrees, "attitude from nominal (deg)"),
        (panels[1, 1], "K", of_K, attitude, degrees, "attitude from nominal (deg)"),
        (panels[2, 0], "F", of_F, ends, feet, "altitude error at end (ft)"),
        (panels[2, 1], "K", of_rmpc, ends, feet, "altitude error at end,\nRMPC (ft)"),
    ):
        for group, columns in results.items():
            for name, style in zip(names, ("o-", "o--"), strict=False):
                axis.plot(factors[law], unit * np.array(columns[name]), style, color=group.color, markersize=3)
        axis.set_ylabel(label)
    for axis in panels[1]:
        axis.axhline(0.5, color="black", linewidth=0.6)
    panels[1, 1].sharey(panels[1, 0])
    for axis in (panels[0, 1], *panels[2]):
        axis.set_ylim(bottom=0.0)
    for axis, law in zip(panels[2], ("F", "K"), strict=True):
        axis.set_xlabel(f"factor on a group of weights of {law}")
    for axis in panels.ravel():
        _factor_axis(axis)
    letter(panels.ravel())
    groups = [Line2D([], [], color=group.color, marker="o", markersize=3, label=group.label) for group in of_K]
    figure.legend(handles=groups, loc="outside upper center", ncols=2, frameon=False)


def _factor_axis(axis: Axes) -> None:
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(FixedLocator(FACTORS))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.2g}"))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_minor_formatter(NullFormatter())


def _feedback_findings(factors: tuple[float, ...], results: Results, without: dict[Group, list[float]]) -> list[str]:
    feet, degrees = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]

    def at(group: Group, index: int) -> str:
        attitude, altitude = (
            results[group][f"{name}_worst"][index]
            for name in ("post_fault_attitude_from_nominal", "altitude_end_error")
        )
        loop = "stable" if without[group][index] < 0.0 else "unstable"
        return (
            f"the attitude deviation from nominal is {degrees * attitude:.3f} deg, the altitude error at the end is "
            f"{feet * altitude:.1f} ft, and the linear loop without notch is {loop}"
        )

    own = f"F, the baseline's own weights, worst corner: {at(ELEVATOR, factors.index(1.0))}"
    return [own, *(f"F, {g.label} {_said(factors, partial(at, g))}" for g in results)]


def _nominal_findings(factors: tuple[float, ...], of_K: Results, of_rmpc: Results) -> list[str]:
    feet, degrees = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]

    def at(group: Group, index: int) -> str:
        settled = ", ".join(
            f"the {axis} {_settles(of_K[group][f'{axis}_settling_time_nominal'][index])}"
            for axis in ("altitude", "velocity")
        )
        attitude = degrees * of_K[group]["post_fault_attitude_from_nominal_worst"][index]
        off = feet * of_rmpc[group]["altitude_end_error_nominal"][index]
        lost = 1.0 - of_rmpc[group]["finished"][index]
        return (
            f"{settled}, the worst attitude deviation from nominal is {attitude:.3f} deg, and the altitude error of "
            f"RMPC at the end is {off:.0f} ft" + (f" ({100.0 * lost:.0f} % of its flights are lost)" if lost else "")
        )

    def ends(results: Results) -> str:
        values = np.array([columns["altitude_end_error_nominal"] for columns in results.values()])
        return f"{feet * np.nanmin(values):.1f} to {feet * np.nanmax(values):.1f} ft"

    return [
        f"K, the baseline's own weights: {at(ELEVATOR, factors.index(1.0))}",
        *(f"K, {g.label} {_said(factors, partial(at, g))}" for g in of_K),
        f"over all weights of K studied, the altitude error at the end is {ends(of_K)} with the tube and "
        f"{ends(of_rmpc)} with RMPC (nominal vehicle)",
    ]


def _said(factors: tuple[float, ...], say: Callable[[int], str]) -> str:
    """Return the texts of ``say`` for the smallest and the largest factor."""
    return "; ".join(f"times {factors[index]:g}: {say(index)}" for index in (0, -1))


def _settles(value: float) -> str:
    return "does not settle before the fault" if np.isnan(value) else f"settles in {value:.1f} s"


STUDY = Study("weights", "Weights of F and K, input bounds of K", run)

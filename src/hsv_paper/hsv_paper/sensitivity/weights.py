"""The weights of F and K and the input bounds of K, which the paper leaves open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from hsv.base.units import to_paper
from hsv.control.design import ControlDesign
from hsv.design.baseline import disturbance_columns, nominal_family, nominal_problem, with_family
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import DesignInputs, find_inputs, read_inputs
from hsv.flight.scenario import load_scenario
from hsv.model.signals import N_RIGID, N_STATES
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.flights import Point
from hsv_paper.linear_loop import Corners, Feedback, stability_limit
from hsv_paper.plots import BLUE, GREEN, ORANGE, PURPLE, RED, ZERO, letter, new_figure
from hsv_paper.sensitivity.sweep import RMPC_DECOUPLED, WITH_NOTCH, WITHOUT_NOTCH, Columns, Controller, sweep
from hsv_paper.study import Outcome, Scope, in_words

FACTORS = (0.5, 0.5**0.5, 1.0, 2.0**0.5, 2.0)
"""Factors by which a group is multiplied; 1: the baseline's own value."""

FEET, DEGREES = to_paper(1.0, "m")[0], to_paper(1.0, "rad")[0]


@dataclass(frozen=True)
class Group:
    """Fields of a table of design inputs that are varied together, and their colour in the plots."""

    label: str
    color: str
    table: str
    names: tuple[str, ...]

    def times(self, part: Any, factor: float) -> Any:
        """Return the inputs of F or of K, ``part``, with this group times ``factor``."""
        table = getattr(part, self.table)
        changed = table.model_copy(update={name: factor * getattr(table, name) for name in self.names})
        return part.model_copy(update={self.table: changed})


ELEVATOR = Group("scale of the elevator", RED, "input_scale", ("elevator_deflection",))
WEIGHTS = (
    Group("scale of altitude and velocity", BLUE, "state_scale", ("altitude", "velocity")),
    Group(
        "scale of the angles and the pitch rate", GREEN, "state_scale", ("angle_of_attack", "pitch_angle", "pitch_rate")
    ),
    Group("scale of the fuel equivalence ratio", ORANGE, "input_scale", ("fuel_equivalence_ratio",)),
    ELEVATOR,
)
"""The weights are one over the squares of these scales: psi and sigma of K (eq. 31), and those of F."""

BOUNDS = Group("bounds of the nominal inputs", PURPLE, "input_bound", ("fuel_equivalence_ratio", "elevator_deflection"))
"""The bounds of K (eq. 35)."""

GROUPS = {"F": WEIGHTS, "K": (*WEIGHTS, BOUNDS)}
"""Varied groups by law."""

Results = dict[Group, Columns]


@cache
def _inputs() -> DesignInputs:
    return read_inputs(find_inputs("baseline"))


@cache
def varied(law: str, group: Group, factor: float) -> ControlDesign:
    """Return the baseline with F or the family of K recomputed, with ``group`` of its weights or bounds multiplied.

    Raises:
        DesignError: There is no solution.
    """
    flown, inputs = design("baseline"), _inputs()
    if factor == 1.0:
        return flown
    if law == "F":
        part, polytope = group.times(inputs.feedback, factor), flown.polytope
        A, B = polytope.A[:, :N_RIGID, :N_RIGID], polytope.B[:, :N_RIGID]
        state_scale, input_scale = part.state_scale.array(), part.input_scale.array()
        found = feedback_gain(A, B, disturbance_columns(inputs), state_scale, input_scale, part.method)
        gain = np.zeros((2, N_STATES))
        gain[:, :N_RIGID] = found.F
        return replace(flown, feedback_gain=gain, tube=None)
    changed = inputs.model_copy(update={"nominal": group.times(inputs.nominal, factor)})
    problem = nominal_problem(changed, flown.polytope, changed.nominal.input_bound.array())
    scaled = replace(flown, tube=None, nominal_state_scale=problem.state_scale, nominal_input_scale=problem.input_scale)
    return with_family(scaled, problem, nominal_family(changed, problem, lambda *_: None))


def run(scope: Scope) -> Outcome:
    """Design F and K with each group of weights times each factor, linearise and fly Case 1 with them."""
    factors = {"F": FACTORS[:: 1 if scope.coarseness < 2.0 else 2], "K": FACTORS[::2]}
    wanted = [(law, group, factor) for law, along in factors.items() for group in GROUPS[law] for factor in along]
    for done, one in enumerate(wanted):
        scope.progress("weights, designs", done, len(wanted))
        varied(*one)
    scope.progress("weights, designs", len(wanted), len(wanted))
    growths = {
        notched: {group: [_growth(group, factor, notched, scope.over) for factor in factors["F"]] for group in WEIGHTS}
        for notched in (True, False)
    }

    def flown(law: str, scenario: str) -> Results:
        fixed = load_scenario(scenario).parameters()
        along = {
            Controller(group.label, scenario, group.color): [
                Point({**varied(law, group, factor).to_parameters(), **fixed}, scope.over) for factor in factors[law]
            ]
            for group in GROUPS[law]
        }
        return dict(zip(GROUPS[law], sweep(scope, f"weights {law} {scenario}", along).values(), strict=True))

    of_F, of_K = flown("F", WITH_NOTCH.scenario), flown("K", WITH_NOTCH.scenario)
    of_rmpc = flown("K", RMPC_DECOUPLED.scenario)
    figure = new_figure(7.6)
    _draw(figure, factors, growths, (of_F, of_K, of_rmpc))
    return Outcome(
        figure,
        "The baseline with one group of its scales or input bounds multiplied by a factor (1 is the baseline itself; a "
        "weight is one over the square of its scale, so that a larger scale is a smaller weight). The left panels vary "
        "F, the right panels K with its input bounds; everything else is unchanged. The flights are those of Case 1 "
        f"with the paper-like coupling, for the nominal vehicle and {in_words(scope.over)} of the parameter bounds. "
        "(a) Largest real part of the poles of the linear sampled loop, over all vehicles and both ends of the step, "
        "before and after the fault; with notch (solid) and without (dashed). (b) Time until altitude (solid) and "
        "velocity (dashed) have settled to 2 % of the step, nominal vehicle; a line ends where they do not settle "
        "before the fault. (c), (d) Attitude deviation from nominal after the fault, worst corner; the black line is "
        "half a degree. (e) Altitude error at the end, nominal vehicle (solid) and worst corner (dashed). (f) The same "
        "error with robust MPC and the fourth gain, as the paper flies it: on the decoupled model, without notch; a "
        "dashed line ends where a flight is lost.",
        (
            *_feedback_findings(factors["F"], of_F, growths[False]),
            *_elevator_limits(scope.over),
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


def _growth(group: Group, factor: float, notched: bool, over: Corners) -> float:
    loop = Feedback.of(design("baseline"), notched=notched)
    vehicle = load_vehicle().coupled("paper_like")
    return replace(loop, gain=varied("F", group, factor).feedback_gain).growth(vehicle, over)


def _elevator_limits(over: Corners) -> list[str]:
    """Return in words the scale of the elevator in F up to which the linear loops are stable."""
    own = _inputs().feedback.input_scale.elevator_deflection

    def limit(notched: bool, vehicles: Corners) -> str:
        found = stability_limit(lambda factor: _growth(ELEVATOR, factor, notched, vehicles), FACTORS)
        return "at every factor" if found is None else f"up to {found * own:.3f} rad"

    return [
        f"{controller.label}, scale of the elevator in F ({own:g} rad in the baseline): the linear loop is stable "
        f"{limit(notched, over[:1])} (nominal vehicle) and {limit(notched, over)} (worst of {in_words(over)})"
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
    for notched, rows in growths.items():
        for group, values in rows.items():
            panels[0, 0].plot(factors["F"], values, "o-" if notched else "o--", color=group.color, markersize=3)
    panels[0, 0].axhline(0.0, **ZERO)
    panels[0, 0].set_ylabel("largest real part (1/s)")
    ends = ("altitude_end_error_nominal", "altitude_end_error_worst")
    settling = ("altitude_settling_time_nominal", "velocity_settling_time_nominal")
    attitude = ("post_fault_attitude_from_nominal_worst",)
    for axis, law, results, names, unit, label in (
        (panels[0, 1], "K", of_K, settling, 1.0, "step settled (s)"),
        (panels[1, 0], "F", of_F, attitude, DEGREES, "attitude from nominal (deg)"),
        (panels[1, 1], "K", of_K, attitude, DEGREES, "attitude from nominal (deg)"),
        (panels[2, 0], "F", of_F, ends, FEET, "altitude error at end (ft)"),
        (panels[2, 1], "K", of_rmpc, ends, FEET, "altitude error at end,\nRMPC (ft)"),
    ):
        for group, columns in results.items():
            for name, style in zip(names, ("o-", "o--"), strict=False):
                axis.plot(factors[law], unit * np.array(columns[name]), style, color=group.color, markersize=3)
        axis.set_ylabel(label)
    for axis in panels[1]:
        axis.axhline(0.5, **ZERO)
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


def _feedback_findings(factors: Sequence[float], results: Results, without: dict[Group, list[float]]) -> list[str]:
    def at(group: Group, index: int) -> str:
        columns = results[group]
        return (
            "the attitude deviation from nominal is "
            f"{DEGREES * columns['post_fault_attitude_from_nominal_worst'][index]:.3f} deg, the altitude error at the "
            f"end is {FEET * columns['altitude_end_error_worst'][index]:.1f} ft, and the linear loop without notch is "
            f"{'stable' if without[group][index] < 0.0 else 'unstable'}"
        )

    own = f"F, the baseline's own weights, worst corner: {at(ELEVATOR, factors.index(1.0))}"
    return [own, *(f"F, {group.label} {_at_both_ends(factors, group, at)}" for group in results)]


def _nominal_findings(factors: Sequence[float], of_K: Results, of_rmpc: Results) -> list[str]:
    def settled(group: Group, index: int, axis: str) -> str:
        time = of_K[group][f"{axis}_settling_time_nominal"][index]
        return f"the {axis} {'does not settle before the fault' if np.isnan(time) else f'settles in {time:.1f} s'}"

    def at(group: Group, index: int) -> str:
        attitude = DEGREES * of_K[group]["post_fault_attitude_from_nominal_worst"][index]
        off = FEET * of_rmpc[group]["altitude_end_error_nominal"][index]
        lost = 1.0 - of_rmpc[group]["finished"][index]
        return (
            f"{settled(group, index, 'altitude')}, {settled(group, index, 'velocity')}, the worst attitude deviation "
            f"from nominal is {attitude:.3f} deg, and the altitude error of RMPC at the end is {off:.0f} ft"
            + (f" ({100.0 * lost:.0f} % of its flights are lost)" if lost else "")
        )

    def ends(results: Results) -> str:
        values = np.array([columns["altitude_end_error_nominal"] for columns in results.values()])
        return f"{FEET * np.nanmin(values):.1f} to {FEET * np.nanmax(values):.1f} ft"

    return [
        f"K, the baseline's own weights: {at(ELEVATOR, factors.index(1.0))}",
        *(f"K, {group.label} {_at_both_ends(factors, group, at)}" for group in of_K),
        f"over all weights of K studied, the altitude error at the end is {ends(of_K)} with the tube and "
        f"{ends(of_rmpc)} with RMPC (nominal vehicle)",
    ]


def _at_both_ends(factors: Sequence[float], group: Group, text: Callable[[Group, int], str]) -> str:
    """Return the texts for the smallest and the largest factor."""
    return "; ".join(f"times {factors[index]:g}: {text(group, index)}" for index in (0, -1))

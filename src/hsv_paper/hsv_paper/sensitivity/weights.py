"""Sensitivity to the weights of F and K and to the input bounds of K, which the paper leaves open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from hsv.certificate.loops import Feedback
from hsv.control.design import ControlDesign
from hsv.design.baseline import disturbance_columns, nominal_family, nominal_problem, with_family
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import DesignInputs, find_inputs, read_inputs
from hsv.flight.scenario import load_scenario
from hsv.model.signals import N_RIGID, N_STATES
from hsv.model.vehicle import load_vehicle
from hsv_paper.designs import design
from hsv_paper.flights import Point
from hsv_paper.linear_loop import Corners, largest_growth
from hsv_paper.plots import BLUE, DEGREES, FEET, GREEN, ORANGE, PURPLE, RED, ZERO, new_figure
from hsv_paper.sensitivity.sweep import RMPC_DECOUPLED, WITH_NOTCH, Columns, Controller, sweep
from hsv_paper.study import Outcome, Scope, in_words, rounded

FACTORS = (0.5, 0.5**0.5, 1.0, 2.0**0.5, 2.0)
"""Factors on a group of weights or bounds; 1 is the baseline itself."""

FLOWN = FACTORS[::2]
"""Factors for which flights are simulated."""

ATTITUDE = "post_fault_attitude_from_nominal_worst"


@dataclass(frozen=True)
class Group:
    """Design inputs that are varied together: the fields ``names`` of ``table``, with a label and a colour."""

    label: str
    color: str
    table: str
    names: tuple[str, ...]

    def times(self, part: Any, factor: float) -> Any:
        """Return ``part``, the design inputs of F or of K, with the fields of this group multiplied by ``factor``."""
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
"""Groups of scales. A weight is one over the square of a scale: psi and sigma of K (eq. 31), and those of F."""

BOUNDS = Group("bounds of the nominal inputs", PURPLE, "input_bound", ("fuel_equivalence_ratio", "elevator_deflection"))
"""The bounds of the nominal inputs, which K keeps (eq. 35)."""

GROUPS = {"F": WEIGHTS, "K": (*WEIGHTS, BOUNDS)}
"""The groups to vary, for F and for K."""

Results = dict[Group, Columns]


@cache
def _inputs() -> DesignInputs:
    return read_inputs(find_inputs("baseline"))


@cache
def varied(law: str, group: Group, factor: float) -> ControlDesign:
    """Return the baseline with F, or the family of K, recomputed with ``factor`` times a group of its inputs.

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
    """Vary weights of F and K and bounds of K by group; compute linear loops (F) and, for :data:`FLOWN`, flights."""

    def flown(law: str, flown: Controller) -> Results:
        fixed = load_scenario(flown.scenario).parameters()
        groups = {Controller(group.label, flown.scenario, group.color): group for group in GROUPS[law]}

        def point(controller: Controller, factor: float) -> Point:
            return Point({**varied(law, groups[controller], factor).to_parameters(), **fixed}, scope.over)

        return {groups[c]: columns for c, columns in sweep(scope, list(groups), FLOWN, point).items()}

    of_F, of_K, of_rmpc = flown("F", WITH_NOTCH), flown("K", WITH_NOTCH), flown("K", RMPC_DECOUPLED)
    figure = new_figure(3.6)
    axis = figure.subplots()
    unstable = {}
    for notched, style in ((True, "o-"), (False, "o--")):
        for group in WEIGHTS:
            scope.progress("weights, linear loops", WEIGHTS.index(group), len(WEIGHTS))
            growths = [_growth(group, factor, notched, scope.over) for factor in FACTORS]
            label = group.label if notched else None
            axis.plot(FACTORS, growths, style, color=group.color, markersize=3, label=label)
            unstable[group] = [value >= 0.0 for value in growths[::2]]
    axis.axhline(0.0, **ZERO)
    axis.set(ylabel="largest real part (1/s)", xlabel="factor on a group of weights of F", xscale="log")
    axis.set_xticks(FACTORS, [f"{factor:.2g}" for factor in FACTORS])
    axis.minorticks_off()
    figure.legend(loc="outside upper center", ncols=2, frameon=False)

    def rows(law: str, columns: Callable[[Group, int], dict[str, Any]]) -> list[dict[str, Any]]:
        """Return rows for the baseline, then for smallest and largest factor in ``FLOWN`` on each group of ``law``.

        ``columns`` returns the further cells of a row from a group and the index of its factor in ``FLOWN``.
        """
        chosen = [(ELEVATOR, FLOWN.index(1.0)), *((group, i) for group in GROUPS[law] for i in (0, len(FLOWN) - 1))]
        return [
            {law: "own weights" if FLOWN[i] == 1.0 else f"{group.label} times {FLOWN[i]:g}"} | columns(group, i)
            for group, i in chosen
        ]

    return Outcome(
        figure,
        "The baseline with one group of its scales or input bounds multiplied by a factor (1 is the baseline itself; a "
        "weight is one over the square of its scale, so that a larger scale is a smaller weight). Either F is varied, "
        "or K with its input bounds; everything else is unchanged. The figure shows the largest growth of all vehicles "
        "over the weights of F, with notch (solid) and without (dashed). The flights are those of Case 1 with the "
        f"paper-like coupling, {in_words(scope.over)}; settling times are those to 2 % of the step of the nominal "
        "vehicle (–: not before the fault). Robust MPC flies the fourth gain as the paper does: on the decoupled "
        "model, without notch.",
        rows(
            "F",
            lambda group, i: {
                "worst attitude from nominal, deg": rounded(DEGREES * of_F[group][ATTITUDE][i], 3),
                "worst altitude error at end, ft": rounded(FEET * of_F[group]["altitude_end_error_worst"][i], 1),
                "linear loop without notch, worst": "unstable" if unstable[group][i] else "stable",
            },
        ),
        rows(
            "K",
            lambda group, i: {
                "altitude settled, s": rounded(of_K[group]["altitude_settling_time_nominal"][i], 1),
                "velocity settled, s": rounded(of_K[group]["velocity_settling_time_nominal"][i], 1),
                "worst attitude from nominal, deg": rounded(DEGREES * of_K[group][ATTITUDE][i], 3),
                "altitude error at end, ft, RMPC": rounded(FEET * of_rmpc[group]["altitude_end_error_nominal"][i]),
                "flights of RMPC lost, %": rounded(100.0 * (1.0 - of_rmpc[group]["finished"][i])),
            },
        ),
    )


def _growth(group: Group, factor: float, notched: bool, over: Corners) -> float:
    loop = Feedback.of(design("baseline"), notched=notched)
    vehicle = load_vehicle().coupled("paper_like")
    return largest_growth(replace(loop, gain=varied("F", group, factor).feedback_gain), vehicle, over)

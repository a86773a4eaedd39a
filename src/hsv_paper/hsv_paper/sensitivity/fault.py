"""The sweep over the depth of the elevator fault."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hsv.base.errors import ScenarioError
from hsv.base.processes import Progress
from hsv_paper.figures.style import GREY, new_figure
from hsv_paper.sensitivity.controllers import ALL, RMPC_DECOUPLED, SAID_RMPC, corners_of, of_scenarios, said_corners
from hsv_paper.sensitivity.study import Outcome, Study, grid
from hsv_paper.sensitivity.sweep import Point, sweep
from hsv_paper.sensitivity.sweep_figures import LOSSES, draw_losses, finding

FLOWN = (*ALL, RMPC_DECOUPLED)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Fly every controller with an elevator effectiveness from 1 down to 0.3."""
    return run_beside(coarseness, folder, progress, ())


def run_beside(coarseness: float, folder: Path, progress: Progress, scenarios: Sequence[str]) -> Outcome:
    """Fly the controllers of ``scenarios``, too.

    Raises:
        ScenarioError: One of them is not acceptable, or has not one fault, of the elevator.
    """
    others = of_scenarios(scenarios)
    for controller in others:
        if (channels := controller.parameters().get("fault.channels", [])) != ["elevator_deflection"]:
            raise ScenarioError(
                f"scenario {controller.scenario!r}: fault: of {', '.join(channels) or 'nothing'}, expected one, of "
                "elevator_deflection"
            )
    shares = grid(0.3, 1.0, 0.025, coarseness)
    over = corners_of(1.0, coarseness)
    flown = (*FLOWN, *others)
    along = {
        c: [Point(c.parameters() | {"fault.parameters": [f"effectiveness={float(left)!r}"]}, over) for left in shares]
        for c in flown
    }
    results = sweep("fault", along, folder, progress)

    figure = new_figure(7.2)
    label = "elevator effectiveness after the fault (0.9: the paper's)"
    axes = draw_losses(figure, shares, {c: results[c] for c in (*ALL, *others)}, label)
    # Without a fault the excursions are tiny, and that end of the curves would take most of the axis.
    axes[1].set_ylim(bottom=0.05)
    axes[2].set_ylim(bottom=1.0)
    for axis in axes:
        axis.axvline(0.9, color=GREY, linewidth=0.6, linestyle=":")
        axis.set_xlim(1.0, 0.3)
    return Outcome(
        figure,
        "Case 1 on the coupled model with the paper-like coupling, flown with the nominal vehicle and "
        f"{said_corners(over)} of the parameter bounds. {LOSSES} {SAID_RMPC}.",
        tuple(
            finding(c, shares, columns, "effectiveness {}", digits=3, rising=False) for c, columns in results.items()
        ),
        {"effectiveness": shares.tolist(), "flights": {c.label: columns for c, columns in results.items()}},
    )


STUDY = Study("fault", "Depth of the fault", run, run_beside)

"""The weight of the elevator in the feedback gain, which the paper leaves open with all other weights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hsv.control.design_file import find_design, read_design
from hsv.design.baseline import disturbance_columns
from hsv.design.feedback import feedback_gain
from hsv.design.inputs import find_inputs, read_inputs
from hsv.simulation.scenario import load_scenario
from hsv.study.corner_flights import fly_over
from hsv.study.figures.style import GREY, letter, new_figure
from hsv.study.linear_loop import worst_growth
from hsv.study.sensitivity.controllers import HALF_WIDTH, WITH_NOTCH, WITHOUT_NOTCH, Controller, corners_of
from hsv.study.sensitivity.flights_strip import Strip, draw_metric, legend, strip
from hsv.study.sensitivity.study import Outcome, Progress, Study
from hsv.units import to_paper
from hsv.vehicle.dynamics import N_RIGID, N_STATES
from hsv.vehicle.parameters import vehicle_parameters

CONTROLLERS = (WITH_NOTCH, WITHOUT_NOTCH)


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Design F with the elevator's scale from 0.03 rad to 0.2 rad, linearise and fly Case 1 with it."""
    inputs, flown = read_inputs(find_inputs("baseline")), read_design(find_design("baseline"))
    scales = np.geomspace(0.03, 0.2, max(2, round(13 / coarseness)))
    over = corners_of(1.0)[:: max(1, round(coarseness))]
    vehicle = vehicle_parameters("paper_like")
    gains = []
    growths: dict[Controller, list[float]] = {controller: [] for controller in CONTROLLERS}
    tables: dict[Controller, list[dict[str, np.ndarray]]] = {controller: [] for controller in CONTROLLERS}
    for index, scale in enumerate(scales):
        progress("weights", index, len(scales))
        found = feedback_gain(
            flown.polytope.A[:, :N_RIGID, :N_RIGID],
            flown.polytope.B[:, :N_RIGID],
            disturbance_columns(inputs, vehicle_parameters("decoupled")),
            inputs.feedback.state_scale.array(),
            np.array([inputs.feedback.input_scale.fuel_equivalence_ratio, scale]),
            inputs.feedback.method,
        )
        gain = np.zeros((2, N_STATES))
        gain[:, :N_RIGID] = found.F
        gains.append(float(gain[1, 4]))
        design = replace(flown, feedback_gain=gain, tube=None)
        for controller in CONTROLLERS:
            notch = flown.notch if controller is WITH_NOTCH else ()
            growths[controller].append(
                max(worst_growth(vehicle.perturbed(corner), gain, notch, flown.period) for corner in over)
            )
            values = {**design.to_parameters(), **load_scenario(controller.scenario).parameters()}
            tables[controller].append(fly_over(values, over, HALF_WIDTH))
    progress("weights", len(scales), len(scales))
    strips = {controller: strip(rows) for controller, rows in tables.items()}

    figure = new_figure(7.2)
    axes = figure.subplots(3, 1, sharex=True)
    for controller, worst in growths.items():
        axes[0].plot(scales, worst, "--", color=controller.color, linewidth=0.9)
        axes[0].plot([], [], color=controller.color, label=controller.label)
    axes[0].axhline(0.0, color="black", linewidth=0.6)
    axes[0].set_ylabel("largest real part (1/s)")
    draw_metric(axes[1], scales, strips, "post_fault_attitude_from_nominal", "rad", "attitude from nominal (deg)")
    draw_metric(axes[2], scales, strips, "altitude_end_error", "m", "altitude error at end (ft)")
    axes[1].axhline(0.5, color="black", linewidth=0.6)
    for axis in axes:
        axis.axvline(inputs.feedback.input_scale.elevator_deflection, color=GREY, linewidth=0.6, linestyle=":")
    axes[2].set_xlabel("scale of the elevator in F (rad); larger: a stiffer feedback; 0.07: the baseline's")
    letter(axes)
    legend(figure, shares=False)
    return Outcome(
        figure,
        "F designed anew with another scale of the elevator, all else the baseline's; nominal vehicle and "
        f"{len(over) - 1} corners, paper-like coupling. (a) Linear sampled loop, before and after the fault, worst "
        "vehicle; (b) attitude from nominal after the fault, black: half a degree; (c) altitude error at the end.",
        tuple(_findings(scales, gains, growths, strips)),
        {
            "elevator_scale_rad": scales.tolist(),
            "elevator_on_pitch_rate_s": gains,
            "growth_per_s": {c.label: worst for c, worst in growths.items()},
            "flights": {c.label: columns for c, columns in strips.items()},
        },
    )


def _findings(
    scales: np.ndarray, gains: list[float], growths: dict[Controller, list[float]], strips: dict[Controller, Strip]
) -> list[str]:
    attitude = to_paper(1.0, "rad")[0] * np.array(strips[WITH_NOTCH]["post_fault_attitude_from_nominal_worst"])
    altitude = to_paper(1.0, "m")[0] * np.array(strips[WITH_NOTCH]["altitude_end_error_worst"])
    said = [
        f"scale {scales[i]:.3f} rad, gain of the elevator on the pitch rate {gains[i]:.2f} s: worst attitude from "
        f"nominal {attitude[i]:.3f} deg, worst altitude error {altitude[i]:.1f} ft with the notch"
        for i in (0, len(scales) // 2, -1)
    ]
    for controller, values in growths.items():
        stable = scales[np.array(values) < 0.0]
        where = f"up to a scale of {stable.max():.3f} rad" if len(stable) else "at no scale looked at"
        said.append(f"{controller.label}: every vehicle stable {where}")
    return said


STUDY = Study("weights", "Weight of the elevator in the feedback", run)

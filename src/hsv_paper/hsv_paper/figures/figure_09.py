"""Figure 9: trajectory in Case 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsv.base.units import FOOT
from hsv_paper.figures import case1
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.style import RED
from hsv_paper.figures.time_histories import ALTITUDE, VELOCITY, histories

TOP = 86480.0
"""ft: top of the altitude panel; the flight with the single gain goes beyond it."""


def draw(material: Material) -> Drawing:
    """Draw altitude and velocity; the altitude with the single gain leaves its panel."""
    altitude = replace(ALTITUDE, shown=(85450.0, TOP))
    velocity = replace(VELOCITY, shown=(7880.0, 8190.0))
    figure = histories((altitude, velocity), case1.curves(material, single=True), reference=True, height=2.7)
    end = {
        name: measured(material, name, "altitude_end_error", "m")
        for name in (case1.NOTCH[0], case1.NO_NOTCH[0], case1.RMPC[0], case1.RMPC_SINGLE[0])
    }
    axis = figure.axes[0]
    single = material.flights[case1.RMPC_SINGLE[0]]
    leaves = single.time[np.argmax(single.state[:, 0] > TOP * FOOT)]
    axis.annotate(
        f"{end[case1.RMPC_SINGLE[0]]:.0f} ft above the\ncommand at 200 s",
        (leaves, TOP - 10.0),
        (leaves + 12.0, TOP - 190.0),
        color=RED,
        fontsize=8,
        arrowprops={"arrowstyle": "-", "color": RED, "linewidth": 0.5},
    )
    velocity_off = measured(material, case1.RMPC_SINGLE[0], "velocity_end_error", "m/s")
    return Drawing(
        figure,
        case1.conditions() + " The single gain, designed for the whole step, is also shown.",
        f"Both tube controllers track through the fault, with an altitude error at 200 s of {end[case1.NOTCH[0]]:.1f} "
        f"ft with the notch and {end[case1.NO_NOTCH[0]]:.1f} ft without it. Robust MPC does not; its error at the end "
        f"is {end[case1.RMPC[0]]:.0f} ft.",
        "The error of robust MPC at the end depends on its gain, which the paper does not state: with the single gain "
        f"of (32) to (35) it is {end[case1.RMPC_SINGLE[0]]:.0f} ft and {velocity_off:.0f} ft/s. An error of a few feet "
        "remains with the tube controllers, because their law has no integral action. Their velocity has kinks "
        f"{case1.switches(material)}, where the nominal state enters the next smaller ellipsoid of the nested family "
        "and the law switches to its gain; the paper's law has a single gain and would have no kinks.",
    )


FIGURE = PaperFigure(
    9, "Trajectory in Case 1. (a) Altitude. (b) Velocity.", draw, (*case1.SCENARIOS, *case1.RMPC_SINGLE)
)

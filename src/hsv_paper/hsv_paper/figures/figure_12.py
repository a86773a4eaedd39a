"""Figure 12: control inputs in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.model.vehicle import load_vehicle
from hsv_paper.figures import case1
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import LIMITS, gain_switches, input_extremes, input_ranges, limited
from hsv_paper.figures.time_histories import INPUTS, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case1.curves(material), zoom=Zoom(98.0, 118.0), height=2.3)
    _, largest = input_extremes(material, case1.RMPC)
    flight, limits = material.flights[case1.NOTCH[0]], load_vehicle().decoupled.input_maximum
    steps = gain_switches(flight)
    jumps = np.abs(flight.command[steps] - flight.command[steps - 1]).max(axis=0)
    return Drawing(
        figure,
        case1.conditions() + f" The limits, {LIMITS}, are drawn where they are near the curves.",
        f"The inputs stay within their limits and are {limited(material, case1.SCENARIOS)}. With uncertain and nominal "
        "parameters together, the fuel ratio and the elevator range over "
        f"{input_ranges(material, case1.NOTCH)} with the notch, over {input_ranges(material, case1.NO_NOTCH)} without "
        f"it, and over {input_ranges(material, case1.RMPC)} with robust MPC.",
        "The tube controllers stay far from the limits, so the figure says little about their behaviour at the limits. "
        f"Robust MPC does not: at the step it commands a fuel ratio of {largest[0]:.2f} (limit {limits[0]:g}) and an "
        f"elevator deflection of {largest[1]:.0f} deg (limit {np.degrees(limits[1]):.0f} deg). The jumps in the inputs "
        f"of the tube controllers {case1.switches(material)}, of up to {jumps[0]:.2f} and {np.degrees(jumps[1]):.1f} "
        "deg, are gain switches of the nested family: closer to rest, a tighter gain satisfies the same bounds. The "
        "paper's law has a single gain and would have no jumps. Without the notch, the vibration appears in the "
        "elevator.",
    )


FIGURE = PaperFigure(
    12, "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case1.SCENARIOS
)

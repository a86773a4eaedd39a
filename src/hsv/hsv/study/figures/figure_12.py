"""Figure 12: control inputs in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.study.figures import case1
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.readings import LIMITS, gain_switches, input_extremes, input_ranges, limited
from hsv.study.figures.time_histories import INPUTS, Zoom, histories
from hsv.vehicle.vehicle import load_vehicle


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case1.curves(material), zoom=Zoom(98.0, 118.0), height=2.3)
    _, largest = input_extremes(material, case1.RMPC)
    flight, limits = material.flights[case1.NOTCH[0]], load_vehicle().decoupled.input_maximum
    steps = gain_switches(flight)
    jumps = np.abs(flight.command[steps] - flight.command[steps - 1]).max(axis=0)
    return Drawing(
        figure,
        case1.conditions() + f". Limits: {LIMITS}, drawn where they are near.",
        f"The inputs keep to their limits, {limited(material, case1.SCENARIOS)}. Fuel ratio "
        "and elevator range, uncertain and nominal parameters together, with the notch "
        f"over {input_ranges(material, case1.NOTCH)}, without it over {input_ranges(material, case1.NO_NOTCH)}, by "
        f"robust MPC over {input_ranges(material, case1.RMPC)}.",
        "The tubes are far from the limits, so the figure says little about how their law behaves at them; robust MPC "
        f"is not: at the step it asks for {largest[0]:.2f} of {limits[0]:g} of fuel and for {largest[1]:.0f} "
        f"deg of {np.degrees(limits[1]):.0f} deg of elevator. The teeth of the tubes' inputs "
        f"{case1.switches(material)}, up to {jumps[0]:.2f} and {np.degrees(jumps[1]):.1f} deg high, are switches of "
        "the nested family's gain: nearer to rest a tighter gain fits in the same bounds. The law of the paper has one "
        "gain and none of them. Without the notch the elevator carries the vibration.",
    )


FIGURE = PaperFigure(
    12, "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case1.SCENARIOS
)

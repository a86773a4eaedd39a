"""Figure 17: control inputs in Case 2."""

from __future__ import annotations

import numpy as np

from hsv_paper.figures import case2
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import LIMITS, input_ranges, limited
from hsv_paper.figures.time_histories import INPUTS, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case2.curves(material), zoom=Zoom(98.0, 118.0), height=2.3)
    peaks = [_peak_delay(material, name) for name in (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])]
    return Drawing(
        figure,
        case2.conditions() + f" The limits, {LIMITS}, are outside the range of the panels.",
        f"The inputs stay within a reasonable range and are {limited(material, case2.SCENARIOS)}. With uncertain and "
        "nominal parameters together, the fuel ratio and the elevator range over "
        f"{input_ranges(material, case2.ADJUSTABLE)} with tau = 0.8, over {input_ranges(material, case2.WHOLE)} with "
        f"tau = 1, and over {input_ranges(material, case2.BASELINE)} with the baseline.",
        f"With tau = 0.8, the elevator responds later to the fault: its deflection is largest {peaks[0]:.2f} s after "
        f"the fault, compared with {peaks[1]:.2f} s with tau = 1 and {peaks[2]:.2f} s with the baseline. "
        "The jumps of the fuel ratio at 20 s and 80 s come from the climbing trim: the climb and the acceleration of "
        "the reference start and stop within one step.",
    )


def _peak_delay(material: Material, scenario: str) -> float:
    """Return the time (s) from the fault to the largest elevator deflection."""
    flight = material.flights[scenario]
    assert flight.fault_start is not None
    after = flight.time >= flight.fault_start
    return float(flight.time[after][np.argmax(flight.command[after, 1])] - flight.fault_start)


FIGURE = PaperFigure(
    17, "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case2.SCENARIOS
)

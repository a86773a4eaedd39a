"""Figure 17: control inputs in Case 2."""

from __future__ import annotations

import numpy as np

from hsv.study.figures import case2
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.readings import LIMITS, input_ranges, limited
from hsv.study.figures.time_histories import INPUTS, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case2.curves(material), zoom=Zoom(98.0, 118.0), height=2.3)
    peaks = [_answer(material, name) for name in (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])]
    return Drawing(
        figure,
        case2.conditions() + f". Limits: {LIMITS}, beyond what is drawn.",
        f"The inputs stay within a reasonable range, {limited(material, case2.SCENARIOS)}. Fuel ratio "
        "and elevator range, uncertain and nominal parameters together, "
        f"with tau = 0.8 over {input_ranges(material, case2.ADJUSTABLE)}, with tau = 1 over "
        f"{input_ranges(material, case2.WHOLE)}, with the baseline over {input_ranges(material, case2.BASELINE)}.",
        f"With tau = 0.8 the elevator answers the fault later, its highest {peaks[0]:.2f} s after it, with tau = 1 "
        f"{peaks[1]:.2f} s and with the baseline {peaks[2]:.2f} s. The jumps of the fuel ratio at 20 s and 80 s are "
        "the climbing trim's: the reference's climb and acceleration set in and end within one step.",
    )


def _answer(material: Material, scenario: str) -> float:
    """Return how long after the fault (s) the elevator is highest."""
    flight = material.flights[scenario]
    assert flight.fault_start is not None
    after = flight.time >= flight.fault_start
    return float(flight.time[after][np.argmax(flight.command[after, 1])] - flight.fault_start)


FIGURE = PaperFigure(
    17, "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case2.SCENARIOS
)

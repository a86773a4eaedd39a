"""Figure 10: states in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.study.figures import case1
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.readings import measured
from hsv.study.figures.time_histories import ATTITUDE, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw angle of attack, pitch angle and pitch rate."""
    figure = histories(ATTITUDE, case1.curves(material), zoom=Zoom(95.0, 125.0), height=2.1)
    off = {
        name: measured(material, name, "post_fault_attitude_deviation", "rad")
        for name in (case1.NOTCH[0], case1.NO_NOTCH[0], case1.RMPC[0])
    }
    rates = {}
    for name in (case1.NOTCH[0], case1.NO_NOTCH[0]):
        flight = material.flights[name]
        late = (flight.time >= 110.0) & (flight.time <= 120.0)
        rates[name] = np.degrees(np.ptp(flight.state[late, 4]))
    return Drawing(
        figure,
        case1.conditions() + ".",
        "Attitude moves at the fault and settles at the new equilibrium, less with the tube "
        f"({off[case1.NOTCH[0]]:.2f} deg) than with robust MPC ({off[case1.RMPC[0]]:.2f} deg). With the notch it is "
        f"the smoother: the pitch rate between 10 s and 20 s after the fault spans {rates[case1.NOTCH[0]]:.3f} deg/s, "
        f"without it {rates[case1.NO_NOTCH[0]]:.3f} deg/s.",
        f"The size of the excursion is set by the lost elevator and not by the notch: {off[case1.NO_NOTCH[0]]:.2f} "
        "deg without it. What the notch takes away is the ringing that follows. The dips of the tubes before the fault "
        f"follow switches of their gain {case1.switches(material)} (Figure 12).",
    )


FIGURE = PaperFigure(10, "States in Case 1. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", draw, case1.SCENARIOS)

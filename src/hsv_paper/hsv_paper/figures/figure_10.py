"""Figure 10: states in Case 1."""

from __future__ import annotations

import numpy as np

from hsv_paper.figures import case1
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.time_histories import ATTITUDE, Zoom, histories


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
        case1.conditions(),
        "The attitude moves at the fault and settles at the new equilibrium. The excursion is smaller with the tube "
        f"({off[case1.NOTCH[0]]:.2f} deg) than with robust MPC ({off[case1.RMPC[0]]:.2f} deg). The response is "
        "smoother with the notch: between 10 s and 20 s after the fault, the peak-to-peak pitch rate is "
        f"{rates[case1.NOTCH[0]]:.3f} deg/s with it and {rates[case1.NO_NOTCH[0]]:.3f} deg/s without it.",
        "The size of the excursion is determined by the lost elevator and not by the notch: without the notch it is "
        f"{off[case1.NO_NOTCH[0]]:.2f} deg. The notch removes the ringing that follows. The dips of the tube "
        f"controllers before the fault follow gain switches {case1.switches(material)} (Figure 12).",
    )


FIGURE = PaperFigure(10, "States in Case 1. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", draw, case1.SCENARIOS)

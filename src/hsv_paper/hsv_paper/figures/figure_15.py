"""Figure 15: states in Case 2."""

from __future__ import annotations

import numpy as np

from hsv.flight.metrics import FlightData
from hsv_paper.figures import case2
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.time_histories import ATTITUDE, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw angle of attack, pitch angle and pitch rate."""
    figure = histories(ATTITUDE, case2.curves(material), zoom=Zoom(95.0, 125.0), height=2.1)
    names = (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])
    off = [measured(material, name, "post_fault_attitude_deviation", "rad") for name in names]
    flight = material.flights[names[0]]
    moved = [_moved(flight, start) for start in (20.0, 80.0)]
    rates = [_rate(material.flights[name]) for name in names]
    return Drawing(
        figure,
        case2.conditions(),
        f"The attitude moves by {off[0]:.2f} deg at the fault and settles.",
        f"With tau = 1 it moves less, by {off[1]:.2f} deg, and with the baseline by {off[2]:.2f} deg: this is the "
        f"price of tau = 0.8. The attitude also moves when the ramp begins, by {moved[0]:.2f} deg, and when it ends, "
        f"by {moved[1]:.2f} deg, because the reference starts and stops climbing within one step. At these times, the "
        f"largest pitch rate is {rates[2]:.2f} deg/s with the baseline; with the adjustable design it is "
        f"{rates[0]:.2f} deg/s at tau = 0.8 and {rates[1]:.2f} deg/s at tau = 1.",
    )


def _moved(flight: FlightData, start: float) -> float:
    """Return the largest change (deg) of angle of attack or pitch angle within 5 s of ``start`` (s)."""
    window = (flight.time >= start) & (flight.time <= start + 5.0)
    attitude = flight.state[window, 2:4]
    return float(np.degrees(np.abs(attitude - attitude[0]).max()))


def _rate(flight: FlightData) -> float:
    """Return the largest pitch rate (deg/s) as the ramp begins and ends."""
    ends = np.minimum(np.abs(flight.time - 22.5), np.abs(flight.time - 82.5)) <= 2.5
    return float(np.degrees(np.abs(flight.state[ends, 4]).max()))


FIGURE = PaperFigure(15, "States in Case 2. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", draw, case2.SCENARIOS)

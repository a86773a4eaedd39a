"""Figure 11: the generalised elastic coordinates and their derivatives in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.simulation.metrics import FlightData
from hsv.study.figures import case1
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.readings import gain_switches, measured
from hsv.study.figures.time_histories import ELASTIC, Zoom, histories
from hsv.units import to_paper

_UNIT = "√slug ft/s"
"""Unit as displayed on a page."""


def draw(material: Material) -> Drawing:
    """Draw both elastic coordinates with their derivatives."""
    figure = histories(
        ELASTIC, case1.curves(material, vibrating=True), zoom=Zoom(99.0, 107.0), nominal_apart=True, height=1.9
    )
    decay = {
        name: measured(material, name, "elastic_decay_time", "s")
        for name in (case1.NOTCH[0], case1.NO_NOTCH[0], case1.NOTCH[1], case1.NO_NOTCH[1])
    }
    before = [_span(material, case1.NO_NOTCH[0], start, start + 10.0) for start in (30.0, 90.0)]
    spans = [_span(material, name, 100.0, 200.0) for name in (case1.NOTCH[0], case1.RMPC[0])]
    flight = material.flights[case1.NOTCH[0]]
    bursts = [_largest(flight, flight.time[step]) for step in gain_switches(flight)]
    return Drawing(
        figure,
        case1.conditions("middle column") + ".",
        f"The coordinates vibrate at the fault and return to rest; with the notch within {decay[case1.NOTCH[0]]:.1f} "
        f"s (5 % of the peak of their rates; nominal parameters {decay[case1.NOTCH[1]]:.1f} s), without it they still "
        f"ring at the end, {decay[case1.NO_NOTCH[0]]:.0f} s later (nominal {decay[case1.NO_NOTCH[1]]:.0f} s).",
        "Without the notch the second mode already grows before the fault with these parameters: its rate spans "
        f"{before[0]:.2f} {_UNIT} from 30 s to 40 s and {before[1]:.2f} from 90 s to 100 s. The fault lowers the "
        "gain of the loop and calms it. Robust MPC does not vibrate a lot more than the tubes: it flies the decoupled "
        f"model, which feeds no vibration back (second rate after the fault {spans[1]:.2f}, tube with notch "
        f"{spans[0]:.2f}); what moves far are its coordinates, with the angle of attack. The bursts of the tubes "
        f"{case1.switches(material)} are switches of the nested family's gain, which moves the elevator in one step; "
        f"with the notch the second rate reaches {max(bursts):.2f} in them, {_largest(flight, 100.0):.2f} at the "
        "fault. The law of the paper has one gain and none of them.",
    )


def _span(material: Material, scenario: str, start: float, end: float) -> float:
    flight = material.flights[scenario]
    shown = (flight.time >= start) & (flight.time <= end)
    return to_paper(float(np.ptp(flight.state[shown, 8])), "kg^0.5 m/s")[0]


def _largest(flight: FlightData, start: float) -> float:
    """Return the largest second rate (sqrt(slug) ft/s) within 3 s of ``start`` (s)."""
    shown = (flight.time >= start) & (flight.time <= start + 3.0)
    return to_paper(float(np.abs(flight.state[shown, 8]).max()), "kg^0.5 m/s")[0]


FIGURE = PaperFigure(
    11,
    "The generalized flexible coordinates of real system in Case 1. (a) The first-order generalized flexible "
    "coordinate. (b) Derivative of the first-order generalized flexible coordinate. (c) The second-order generalized "
    "flexible coordinate. (d) Derivative of the second-order generalized flexible coordinate.",
    draw,
    case1.SCENARIOS,
)

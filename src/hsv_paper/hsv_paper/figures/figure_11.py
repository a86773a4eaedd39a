"""Figure 11: the generalised elastic coordinates and their derivatives in Case 1."""

from __future__ import annotations

import numpy as np

from hsv.base.units import to_paper
from hsv.flight.metrics import FlightData
from hsv_paper.figures import case1
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import gain_switches, measured
from hsv_paper.figures.time_histories import ELASTIC, Zoom, histories

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
        case1.conditions("the middle column shows"),
        "The coordinates vibrate at the fault and return to rest. With the notch, both rates are within 5 % of their "
        f"peak after {decay[case1.NOTCH[0]]:.1f} s (with nominal parameters, {decay[case1.NOTCH[1]]:.1f} s). Without "
        f"the notch, they still ring at the end, {decay[case1.NO_NOTCH[0]]:.0f} s after the fault (with nominal "
        f"parameters, they decay in {decay[case1.NO_NOTCH[1]]:.0f} s).",
        "Without the notch, the second mode already grows before the fault with these parameters: its peak-to-peak "
        f"rate is {before[0]:.2f} {_UNIT} from 30 s to 40 s and {before[1]:.2f} from 90 s to 100 s. The fault lowers "
        "the loop gain and thereby reduces the vibration. Robust MPC does not vibrate a lot more than the tube "
        "controllers: it flies the decoupled model, which feeds no vibration back (peak-to-peak second rate after the "
        f"fault {spans[1]:.2f}, tube with notch {spans[0]:.2f}). Only its coordinates move far, with the angle of "
        f"attack. The bursts of the tube controllers {case1.switches(material)} are gain switches of the nested "
        f"family, which move the elevator within one step; with the notch, the second rate reaches {max(bursts):.2f} "
        f"in them and {_largest(flight, 100.0):.2f} at the fault. The paper's law has a single gain and would have no "
        "bursts.",
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

"""The curves of Figures 9 to 12, and what is measured on them."""

from __future__ import annotations

from hsv.simulation.metrics import flight_metrics
from hsv.study.figures.figure import Material
from hsv.study.figures.style import BLUE, GREEN, ORANGE, RED
from hsv.study.figures.time_histories import Curve
from hsv.units import to_paper

NOTCH = ("case1_uncertain", "case1")
NO_NOTCH = ("case1_uncertain_no_notch", "case1_no_notch")
RMPC = ("case1_uncertain_rmpc_fourth_k", "case1_rmpc_fourth_k")
RMPC_SINGLE = ("case1_uncertain_rmpc", "case1_rmpc")
"""Scenarios with uncertain and with nominal parameters."""

SCENARIOS = (*NOTCH, *NO_NOTCH, *RMPC)
"""Of Figures 10 to 12."""

CONDITIONS = (
    "Uncertain parameters as in `case1_uncertain` (mass +5 %, moment of inertia -5 %, the rest at half its bound), "
    "elevator effectiveness 0.9 from 100 s; thin: nominal parameters. Robust MPC flies the decoupled model, as in the "
    "paper, with the fourth gain of the family, the tightest that survives the step with these parameters"
)


def curves(material: Material, *, single: bool = False) -> list[Curve]:
    """Return the controllers of Figures 9 to 12, the tube with notch on top.

    Args:
        material: Gives the flights.
        single: Show robust MPC with the single gain too.
    """
    f = material.flights
    # What rings most lies lowest, so that the others are seen before it.
    pairs = [("Tube-MPC without notch", GREEN, NO_NOTCH), ("RMPC on the DM, fourth gain", ORANGE, RMPC)]
    if single:
        pairs.append(("RMPC on the DM, single gain", RED, RMPC_SINGLE))
    pairs.append(("Tube-MPC with notch", BLUE, NOTCH))
    # Under the curve with notch, where both are the same, the one without stays visible.
    widths = {GREEN: 2.0} if single else {}
    return [
        Curve(label, color, f[uncertain], f[nominal], width=widths.get(color, 1.1))
        for label, color, (uncertain, nominal) in pairs
    ]


def measured(material: Material, scenario: str, metric: str, unit: str) -> float:
    """Return a metric of a flight in the paper's unit."""
    return to_paper(flight_metrics(material.flights[scenario])[metric], unit)[0]

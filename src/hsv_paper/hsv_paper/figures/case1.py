"""The curves of Figures 9 to 12, and the times at which their nominal gain changes."""

from __future__ import annotations

from hsv_paper.figures.figure import Material
from hsv_paper.figures.readings import gain_switches, in_words
from hsv_paper.figures.style import BLUE, GREEN, ORANGE, RED
from hsv_paper.figures.time_histories import Curve

NOTCH = ("case1_uncertain", "case1")
NO_NOTCH = ("case1_uncertain_no_notch", "case1_no_notch")
RMPC = ("case1_uncertain_rmpc_fourth_k", "case1_rmpc_fourth_k")
RMPC_SINGLE = ("case1_uncertain_rmpc", "case1_rmpc")
"""Scenarios with uncertain and with nominal parameters."""

SCENARIOS = (*NOTCH, *NO_NOTCH, *RMPC)
"""Scenarios of Figures 10 to 12."""


def conditions(nominal: str = "thin lines show") -> str:
    """Return a description of the flights; ``nominal``: what shows those with nominal parameters."""
    return (
        "The uncertain parameters are those of `case1_uncertain` (mass +5 %, moment of inertia -5 %, the others at "
        "half of their bounds), and the elevator effectiveness is 0.9 from 100 s on; "
        f"{nominal} nominal parameters. Robust MPC flies the decoupled model without tube and notch filter, as in the "
        "paper, with the fourth gain of the family, the tightest gain with which no corner of the bounds is lost."
    )


def curves(material: Material, *, single: bool = False, vibrating: bool = False) -> list[Curve]:
    """Return the controllers of Figures 9 to 12; what rings most is drawn first, so that it does not hide the others.

    Args:
        material: Gives the flights.
        single: Show robust MPC with the single gain too.
        vibrating: Robust MPC rings about as much as the tube with notch: draw it last, with a thinner line.
    """
    f = material.flights
    # The curve without notch is wider, so that it stays visible where both are the same.
    without = ("Tube-MPC without notch", GREEN, NO_NOTCH, 2.0 if single else 1.1)
    tube = ("Tube-MPC with notch", BLUE, NOTCH, 1.1)
    robust = [("RMPC on the DM, fourth gain", ORANGE, RMPC, 0.7 if vibrating else 1.1)]
    if single:
        robust.append(("RMPC on the DM, single gain", RED, RMPC_SINGLE, 1.1))
    order = [without, tube, *robust] if vibrating else [without, *robust, tube]
    return [Curve(label, color, f[uncertain], f[nominal], width) for label, color, (uncertain, nominal), width in order]


def switches(material: Material) -> str:
    """Return at which times (s) the tubes' nominal law takes the next gain, in words."""
    flight = material.flights[NOTCH[0]]
    return f"at {in_words(flight.time[gain_switches(flight)])} s"

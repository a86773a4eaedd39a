"""The curves of Figures 14 to 17."""

from __future__ import annotations

from hsv_paper.figures.figure import Material
from hsv_paper.figures.style import BLUE, GREEN, ORANGE
from hsv_paper.figures.time_histories import Curve

ADJUSTABLE = ("case2_uncertain", "case2")
WHOLE = ("case2_uncertain_tau1", "case2_tau1")
BASELINE = ("case2_uncertain_baseline", "case2_baseline")
"""Scenarios with uncertain and with nominal parameters."""

SCENARIOS = (*ADJUSTABLE, *WHOLE, *BASELINE)


def conditions(nominal: str = "thin lines show") -> str:
    """Return a description of the flights; ``nominal``: what shows those with nominal parameters."""
    return (
        "The uncertain parameters are those of `case2_uncertain` (the same as in Case 1). The ramp lasts from 20 s to "
        f"80 s, and the elevator effectiveness is 0.9 from 100 s on; {nominal} nominal parameters. The adjustable "
        "design is flown with the paper's tau = 0.8 and with tau = 1, and the baseline design on the same ramp."
    )


def curves(material: Material) -> list[Curve]:
    """Return the three controllers, the paper's on top."""
    f = material.flights
    named = (("baseline", ORANGE, BASELINE), (r"adjustable, $\tau$ = 1", GREEN, WHOLE))
    below = [Curve(label, color, f[u], f[n], width=2.0) for label, color, (u, n) in named]
    below[1] = Curve(below[1].label, GREEN, f[WHOLE[0]], f[WHOLE[1]], width=1.4)
    return [*below, Curve(r"adjustable, $\tau$ = 0.8", BLUE, f[ADJUSTABLE[0]], f[ADJUSTABLE[1]], width=0.9)]

"""Figure 12: control inputs in Case 1."""

from __future__ import annotations

from hsv.study.figures import case1
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.time_histories import INPUTS, histories


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case1.curves(material), zoom=(98.0, 118.0), height=2.3)

    def ends(name: str, unit: str) -> list[float]:
        return [case1.measured(material, case1.NOTCH[0], f"{name}_{end}", unit) for end in ("minimum", "maximum")]

    fuel, elevator = ends("fuel_equivalence_ratio", "1"), ends("elevator_deflection", "rad")
    limited = case1.measured(material, case1.NOTCH[0], "saturated_steps", "1")
    return Drawing(
        figure,
        case1.CONDITIONS + ".",
        f"The inputs keep to their limits, 0 to 1.5 and -30 deg to 30 deg: with the notch {fuel[0]:.2f} to "
        f"{fuel[1]:.2f} and {elevator[0]:.1f} deg to {elevator[1]:.1f} deg, {limited:.0f} "
        "steps limited.",
        "They are far from the limits, so the figure says little about how the law behaves at them. Without the notch "
        "the elevator carries the vibration.",
    )


FIGURE = PaperFigure(
    12, "Control inputs in Case 1. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case1.SCENARIOS
)

"""Figure 17: control inputs in Case 2."""

from __future__ import annotations

from hsv.study.figures import case2
from hsv.study.figures.case1 import measured
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.time_histories import INPUTS, histories


def draw(material: Material) -> Drawing:
    """Draw both inputs as commanded."""
    figure = histories(INPUTS, case2.curves(material), zoom=(98.0, 118.0), height=2.3)

    def ends(name: str, unit: str) -> list[float]:
        return [measured(material, case2.ADJUSTABLE[0], f"{name}_{end}", unit) for end in ("minimum", "maximum")]

    fuel, elevator = ends("fuel_equivalence_ratio", "1"), ends("elevator_deflection", "rad")
    limited = measured(material, case2.ADJUSTABLE[0], "saturated_steps", "1")
    return Drawing(
        figure,
        case2.CONDITIONS + ".",
        f"The inputs stay within a reasonable range: {fuel[0]:.2f} to {fuel[1]:.2f} and {elevator[0]:.1f} deg to "
        f"{elevator[1]:.1f} deg, {limited:.0f} steps limited.",
        "With tau = 0.8 the elevator answers the fault more slowly than with the whole feedback. The jumps of the "
        "fuel ratio at 20 s and 80 s are the climbing trim's: the reference's climb and acceleration set in and end "
        "within one step.",
    )


FIGURE = PaperFigure(
    17, "Control inputs in Case 2. (a) Fuel-to-air ratio. (b) Elevator deflection.", draw, case2.SCENARIOS
)

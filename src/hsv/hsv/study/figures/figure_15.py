"""Figure 15: states in Case 2."""

from __future__ import annotations

from hsv.study.figures import case2
from hsv.study.figures.case1 import measured
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.time_histories import ATTITUDE, histories


def draw(material: Material) -> Drawing:
    """Draw angle of attack, pitch angle and pitch rate."""
    figure = histories(ATTITUDE, case2.curves(material), zoom=(95.0, 125.0), height=2.1)
    names = (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])
    off = [measured(material, name, "post_fault_attitude_deviation", "rad") for name in names]
    return Drawing(
        figure,
        case2.CONDITIONS + ".",
        f"Attitude stays calm along the ramp, moves by {off[0]:.2f} deg at the fault and settles.",
        f"With the whole feedback it moves less, {off[1]:.2f} deg, as with the baseline, {off[2]:.2f} deg: this is "
        "what tau = 0.8 costs. The corners at which the ramp begins and ends show, because the reference's climb does.",
    )


FIGURE = PaperFigure(15, "States in Case 2. (a) Attack angle. (b) Pitch angle. (c) Pitch rate.", draw, case2.SCENARIOS)

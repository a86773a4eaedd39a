"""Figure 16: the generalised elastic coordinates and their derivatives in Case 2."""

from __future__ import annotations

from hsv_paper.figures import case2
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.time_histories import ELASTIC, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw both elastic coordinates with their derivatives."""
    figure = histories(ELASTIC, case2.curves(material), zoom=Zoom(99.0, 107.0), nominal_apart=True, height=1.9)
    names = (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])
    decay = [measured(material, name, "elastic_decay_time", "s") for name in names]
    nominal = [measured(material, name, "elastic_decay_time", "s") for name in (case2.ADJUSTABLE[1], case2.WHOLE[1])]
    return Drawing(
        figure,
        case2.conditions("the middle column shows"),
        f"The coordinates vibrate at the fault and are at rest after {decay[0]:.1f} s (both rates within 5 % of "
        "their peak).",
        f"The same is true with tau = 1 ({decay[1]:.1f} s) and with the baseline ({decay[2]:.1f} s): all three fly "
        "with the notch filter, without which the vibration continues in Case 1 (Figure 11). With nominal parameters, "
        f"the decay takes {nominal[0]:.1f} s with tau = 0.8 and {nominal[1]:.1f} s with tau = 1.",
    )


FIGURE = PaperFigure(
    16,
    "The generalized flexible coordinates of real system in Case 2. (a) The first-order generalized flexible "
    "coordinate. (b) Derivative of the first-order generalized flexible coordinate. (c) The second-order generalized "
    "flexible coordinate. (d) Derivative of the second-order generalized flexible coordinate.",
    draw,
    case2.SCENARIOS,
)

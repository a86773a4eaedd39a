"""Figure 14: trajectory in Case 2."""

from __future__ import annotations

from hsv_paper.figures import case2
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.time_histories import ALTITUDE, VELOCITY, Zoom, histories


def draw(material: Material) -> Drawing:
    """Draw altitude and velocity along the ramp."""
    closer = Zoom(78.0, 130.0, "end of the ramp, and the fault")
    figure = histories((ALTITUDE, VELOCITY), case2.curves(material), zoom=closer, reference=True, height=2.6)
    names = (case2.ADJUSTABLE[0], case2.WHOLE[0], case2.BASELINE[0])
    lag = [measured(material, name, "velocity_integral_absolute_error", "m") for name in names]
    largest = [measured(material, name, "altitude_error_maximum", "m") for name in names]
    end = measured(material, names[0], "altitude_end_error", "m")
    return Drawing(
        figure,
        case2.conditions(),
        f"The ramp is tracked through the fault; the altitude error is at most {largest[0]:.0f} ft, and {end:.1f} ft "
        "at the end.",
        "The paper says that the adjustable scheme responds faster in velocity. Along a ramp this cannot be seen: the "
        f"integral of the velocity error is {lag[0]:.0f} ft with tau = 0.8, {lag[1]:.0f} ft with tau = 1 and "
        f"{lag[2]:.0f} ft with the baseline. The relaxed bounds of K' make the velocity response faster on a step; the "
        "ramp does not need them. The length of the ramp is our choice; the paper gives none.",
    )


FIGURE = PaperFigure(14, "Trajectory in case 2. (a) altitude. (b) Velocity.", draw, case2.SCENARIOS)

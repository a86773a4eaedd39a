"""Figure 3: effect of the parameters of the notch filter on the open loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hsv.control.notch_filter import NotchSection, notch_response
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.bode import bode_lines, label_bode, pitch_rate_response
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import peak_in_words
from hsv_paper.figures.style import BLUE, GREEN, ORANGE, RED, letter, new_figure
from hsv_paper.mode_peaks import peak_falls

FREQUENCIES = np.logspace(0.0, 2.0, 1500)
POLE_FREQUENCIES = (10.0, 15.0, 20.0)
POLE_DAMPINGS = (0.2, 0.5, 0.8)
COLORS = (GREEN, BLUE, ORANGE)


def draw(material: Material) -> Drawing:
    """Draw elevator to filtered pitch rate of the coupled model, one parameter of the poles changed at a time."""
    section: NotchSection = material.design("baseline").flown.notch[0]
    plain = pitch_rate_response(load_vehicle().coupled("paper_like"), FREQUENCIES)
    figure = new_figure(5.2)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    families = (
        [(f"$\\omega_p$ = {w:g} rad/s", replace(section, pole_frequency=w)) for w in POLE_FREQUENCIES],
        [(f"$\\varepsilon_p$ = {e:g}", replace(section, pole_damping=e)) for e in POLE_DAMPINGS],
    )
    for (magnitude, phase), family in zip(grid.T, families, strict=True):
        bode_lines(magnitude, phase, FREQUENCIES, plain, "without notch", color=RED, linestyle="--")
        for (label, changed), color in zip(family, COLORS, strict=True):
            response = plain * notch_response([changed], FREQUENCIES)
            bode_lines(magnitude, phase, FREQUENCIES, response, label, color=color)
        label_bode(magnitude, phase, FREQUENCIES)
        magnitude.legend(loc="lower left")
    for axis in grid[:, 1]:
        axis.set_ylabel("")
    letter(grid[0])
    grid[0, 0].set_title(f"  effect of $\\omega_p$, $\\varepsilon_p$ = {section.pole_damping:g}", loc="right")
    grid[0, 1].set_title(f"  effect of $\\varepsilon_p$, $\\omega_p$ = {section.pole_frequency:g} rad/s", loc="right")
    fall = peak_falls([section])["first"]
    lag = float(np.degrees(np.angle(notch_response([section], np.array([5.0]))[0])))
    return Drawing(
        figure,
        "The response is from elevator to filtered pitch rate of the coupled model, with the paper-like coupling, "
        f"where Case 1 starts. The zeros are at {section.zero_frequency:g} rad/s, with a damping of "
        f"{section.zero_damping:g}.",
        f"With the design's filter, the peak of the first mode {peak_in_words(fall)}. A larger damping of the poles "
        "widens the notch.",
        f"The filter also acts away from its centre: at 5 rad/s it costs {-lag:.0f} deg of phase. If omega_p differs "
        "from omega_z, the gain above the notch changes by (omega_p/omega_z)^2, 2.4 dB per 15 %; both should be moved "
        "together. The paper gives neither its zeros nor the channel that it shows.",
    )


FIGURE = PaperFigure(
    3,
    "Bode diagram of notch filter's effect on flexible hypersonic vehicle. (a) Effect of omega_p when epsilon_p = "
    "0.5. (b) Effect of epsilon_p when omega_p = 15.",
    draw,
)

"""Figure 13: the elastic rates with the notch filter at the second mode."""

from __future__ import annotations

import numpy as np

from hsv.control.notch_filter import notch_response
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.scenario import load_scenario
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import measured
from hsv_paper.figures.style import BLUE, GREEN
from hsv_paper.figures.time_histories import ELASTIC, Curve, Zoom, histories
from hsv_paper.mode_peaks import elastic_modes

WITH, WITHOUT = "case1_second_mode_notch", "case1_no_notch"


def draw(material: Material) -> Drawing:
    """Draw both elastic rates, with the notch at the second mode and without a notch."""
    curves = [
        Curve("Tube-MPC without notch", GREEN, material.flights[WITHOUT]),
        Curve("Tube-MPC with notch for the second mode", BLUE, material.flights[WITH]),
    ]
    figure = histories((ELASTIC[1], ELASTIC[3]), curves, zoom=Zoom(99.0, 107.0), height=2.3)
    first, second = (
        [measured(material, name, f"elastic_rate_{mode}_decay_time", "s") for name in (WITHOUT, WITH)]
        for mode in (1, 2)
    )
    modes = elastic_modes("paper_like")
    filter_ = assemble(flight_parameters(load_scenario(WITH))).notch_filter
    passed = abs(notch_response(filter_.sections, np.array([modes["first"].natural_frequency]))[0])
    return Drawing(
        figure,
        'The parameters are nominal, which is our interpretation of the paper\'s "nominal system", and the fault '
        f"occurs. The notch is at {filter_.sections[0].zero_frequency:g} rad/s; the second coupled mode is at "
        f"{modes['second'].natural_frequency:.2f} rad/s.",
        f"The second rate decays in {second[1]:.1f} s instead of {second[0]:.1f} s.",
        f"The first rate decays in {first[1]:.1f} s instead of {first[0]:.1f} s, which is more than the slight effect "
        f"that the paper describes: a filter with such wide poles passes only {100.0 * passed:.0f} % of the pitch rate "
        "at the first mode.",
    )


FIGURE = PaperFigure(
    13,
    "Derivative of the generalized flexible coordinates of nominal system in the case of notch filter for the "
    "second-order flexible mode. (a) Derivative of the first-order generalized flexible coordinate. (b) Derivative of "
    "the second-order generalized flexible coordinate.",
    draw,
    (WITH, WITHOUT),
)

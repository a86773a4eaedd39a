"""Figure 2: Bode diagram of the polytopic model against the decoupled model."""

from __future__ import annotations

import numpy as np

from hsv.base.units import FOOT
from hsv.model.lpv.linearisation import frequency_response, linearise, zero_order_hold
from hsv.model.signals import PITCH_RATE
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.bode import bode_lines, label_bode
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.style import BLUE, RED, letter, new_figure
from hsv_paper.linear_loop import ELEVATOR

POINT = (85817.0, 8037.0)
"""ft, ft/s: between the samples of the model."""

FREQUENCIES = np.logspace(-2.0, 2.0, 600)


def draw(material: Material) -> Drawing:
    """Draw elevator to pitch rate of both, at a point between the samples."""
    design = material.design("baseline")
    point = POINT[0] * FOOT, POINT[1] * FOOT
    period = design.flown.period
    exact = zero_order_hold(*linearise(load_vehicle().decoupled, *point), period)
    figure = new_figure(5.0)
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    for system, label, style in (
        (exact, "DM", {"color": RED}),
        (design.flown.polytope.at(*point), "Polytopic LPV", {"color": BLUE, "linestyle": ":", "linewidth": 2.0}),
    ):
        response = frequency_response(*system, FREQUENCIES, period)[:, PITCH_RATE, ELEVATOR]
        bode_lines(magnitude, phase, FREQUENCIES, response, label, **style)
    label_bode(magnitude, phase, FREQUENCIES)
    letter((magnitude, phase))
    magnitude.legend(loc="upper right")
    model, accuracy = design.certificate["model"], design.certificate["model"]["accuracy"]
    rows, columns = model["vertices"]
    return Drawing(
        figure,
        f"The response is from elevator deflection to pitch rate at {POINT[0]:.0f} ft and {POINT[1]:.0f} ft/s, between "
        f"the samples of the model. Both models are discrete with a period of {period:g} s; the polytopic model has "
        f"{rows * columns} vertices ({rows} in altitude, {columns} in velocity).",
        "The two lines overlap. Over the whole envelope, for all states and inputs, the Bode plots differ by at most "
        f"{accuracy['bode_magnitude_error_db']:.1g} dB and {accuracy['bode_phase_error_deg']:.1g} deg; at "
        f"{accuracy['points']} points, the matrices differ by at most {accuracy['relative_frobenius_error']:.1g} of "
        "their norm.",
        "The paper does not say which point, input and output it shows. Both lines belong to the decoupled model, so "
        "the comparison says nothing about the effect of the neglected coupling (Figure 4).",
    )


FIGURE = PaperFigure(
    2,
    "Bode diagram comparison of polytopic LPV and DM. (a) Amplitude frequency characteristic. (b) Phase frequency "
    "characteristic.",
    draw,
)

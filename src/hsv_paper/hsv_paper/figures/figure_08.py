"""Figure 8: Bode diagram of the co-designed polytopic model against the ECM (extended states coupling model)."""

from __future__ import annotations

import numpy as np

from hsv.base.units import FOOT
from hsv.design.inputs import inputs_from_report
from hsv.model.lpv.linearisation import bode_difference, frequency_response
from hsv.model.signals import PITCH_RATE
from hsv_paper.extended_model import codesigned_model, extended_model
from hsv_paper.figures.bode import bode_lines, label_bode
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.style import BLUE, GREY, RED, letter, new_figure
from hsv_paper.linear_loop import ELEVATOR
from hsv_paper.mode_peaks import elastic_modes

POINT = (85817.0, 8037.0)
"""ft, ft/s: between the samples of the model."""

FREQUENCIES = np.logspace(-2.0, 2.0, 1500)


def draw(material: Material) -> Drawing:
    """Draw elevator to filtered pitch rate of both, and of the ECM with its coupling."""
    design = material.design("adjustable")
    certificate = design.certificate
    inputs = inputs_from_report(certificate["inputs"])
    point = POINT[0] * FOOT, POINT[1] * FOOT
    figure = new_figure(5.0)
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    period = inputs.model.period
    drawn = []
    for system, label, style in (
        (extended_model(inputs, "paper_like", point), "ECM with its coupling", {"color": GREY, "linewidth": 0.8}),
        (extended_model(inputs, 0.0, point), "ECM, coupling ignored", {"color": RED}),
        (
            codesigned_model(inputs, point),
            "Codesigned polytopic LPV",
            {"color": BLUE, "linestyle": ":", "linewidth": 2.0},
        ),
    ):
        drawn.append(frequency_response(*system, FREQUENCIES, period)[:, PITCH_RATE, ELEVATOR])
        bode_lines(magnitude, phase, FREQUENCIES, drawn[-1], label, **style)
    decibel, degree = bode_difference(drawn[-1], drawn[0])
    loud, late = np.argmax(decibel), np.argmax(degree)
    elastic = [f"{mode.natural_frequency:.1f}" for mode in elastic_modes("paper_like").values()]
    label_bode(magnitude, phase, FREQUENCIES)
    letter((magnitude, phase))
    magnitude.legend(loc="upper right")
    accuracy = certificate["model"]["accuracy"]
    rows, columns = certificate["model"]["vertices"]
    return Drawing(
        figure,
        f"The response is from elevator deflection to filtered pitch rate at {POINT[0]:.0f} ft and {POINT[1]:.0f} "
        f"ft/s, between the samples of the model. All models are discrete with a period of {period:g} s; the "
        f"co-designed model has {rows * columns} vertices ({rows} in altitude, {columns} in velocity).",
        "The co-designed model, which includes the notch, agrees with the ECM without its coupling. Over the whole "
        f"envelope, for all states and inputs, they differ by at most {accuracy['bode_magnitude_error_db']:.2f} dB and "
        f"{accuracy['bode_phase_error_deg']:.2f} deg; at {accuracy['points']} points, the matrices differ by at most "
        f"{accuracy['relative_frobenius_error']:.1g} of their norm.",
        "With the ECM as the paper writes it, including the coupling (grey, paper-like), the co-designed model agrees "
        f"only below the elastic modes: the lines differ by up to {decibel[loud]:.1f} dB (at {FREQUENCIES[loud]:.1f} "
        f"rad/s) and {degree[late]:.0f} deg (at {FREQUENCIES[late]:.1f} rad/s), near the modes at "
        f"{' and '.join(elastic)} rad/s. No control-oriented model of the paper contains these modes: neglecting the "
        "weak coupling is part of the design, and the price is that stability with flexibility must be shown by other "
        "means.",
    )


FIGURE = PaperFigure(
    8,
    "Bode diagram comparison of codesigned polytopic LPV model and ECM. (a) Amplitude frequency characteristics. (b) "
    "Phase frequency characteristics.",
    draw,
)

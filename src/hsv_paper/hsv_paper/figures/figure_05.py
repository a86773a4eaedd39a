"""Figure 5: one notch filter on both elastic modes."""

from __future__ import annotations

import numpy as np

from hsv.control.notch_filter import notch_response
from hsv.model.lpv.linearisation import bode
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.bode import bode_lines, label_bode, pitch_rate_response
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.readings import peak_in_words
from hsv_paper.figures.style import BLUE, GREY, RED, new_figure
from hsv_paper.mode_peaks import elastic_modes, peak_falls

FREQUENCIES = np.logspace(0.7, 1.7, 3000)


def draw(material: Material) -> Drawing:
    """Draw elevator to pitch rate about both modes, with and without the design's filter, and its gain alone."""
    section = material.design("baseline").flown.notch
    plain = pitch_rate_response(load_vehicle().coupled("paper_like"), FREQUENCIES)
    filter_ = notch_response(section, FREQUENCIES)
    figure = new_figure(5.0)
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    bode_lines(magnitude, phase, FREQUENCIES, plain, "without notch", color=RED, linestyle="--")
    bode_lines(magnitude, phase, FREQUENCIES, plain * filter_, "with notch", color=BLUE)
    magnitude.semilogx(FREQUENCIES, bode(filter_)[0], color=GREY, linewidth=0.7, label="gain of the notch filter alone")
    label_bode(magnitude, phase, FREQUENCIES)
    modes = {name: mode.natural_frequency for name, mode in elastic_modes("paper_like").items()}
    for (name, frequency), side in zip(modes.items(), ("right", "left"), strict=True):
        for axis in (magnitude, phase):
            axis.axvline(frequency, color=GREY, linewidth=0.5, linestyle=":")
        magnitude.annotate(
            f"{name} mode, {frequency:.2f} rad/s",
            (frequency, 1.01),
            xycoords=("data", "axes fraction"),
            va="bottom",
            ha=side,
            fontsize=8,
        )
    falls = peak_falls(section)
    magnitude.legend(loc="lower left")
    ticks = (5, 7, 10, 15, 20, 30, 50)
    phase.set_xticks(ticks, [str(t) for t in ticks], minor=False)
    phase.set_xticks([], minor=True)
    return Drawing(
        figure,
        "The response is from elevator to pitch rate of the coupled model, with the paper-like coupling, where Case 1 "
        f"starts; the notch is at {section[0].zero_frequency:g} rad/s.",
        f"The peak near the first mode {peak_in_words(falls['first'])}; the peak of the second mode, at the edge of "
        f"the notch, {peak_in_words(falls['second'])}.",
        f"The notch is centred at {section[0].zero_frequency:g} rad/s, the value of the paper's Figure 3, and not at "
        f"the mode itself ({modes['first']:.2f} rad/s), so that a dip at the centre and a small peak at the mode "
        "remain next to each other. The lower centre also suits the derived coupling, whose first mode is lower, at "
        f"{elastic_modes('derived')['first'].natural_frequency:.2f} rad/s.",
    )


FIGURE = PaperFigure(5, "Bode diagram of Notch filter on flexible modes.", draw)

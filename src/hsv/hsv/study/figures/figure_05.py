"""Figure 5: one notch filter on both elastic modes."""

from __future__ import annotations

import numpy as np

from hsv.lpv.frequency import bode
from hsv.study.figures.bode import bode_lines, label_bode, notch_response, peak, pitch_rate_response
from hsv.study.figures.figure import Drawing, Material, PaperFigure
from hsv.study.figures.style import BLUE, GREY, RED, new_figure
from hsv.vehicle.parameters import vehicle_parameters

FREQUENCIES = np.logspace(0.7, 1.7, 3000)


def draw(material: Material) -> Drawing:
    """Draw elevator to pitch rate about both modes, with and without the design's filter, and the filter alone."""
    section = material.design("baseline").flown.notch
    plain = pitch_rate_response(vehicle_parameters("paper_like"), FREQUENCIES)
    filter_ = notch_response(section, FREQUENCIES)
    figure = new_figure(5.0)
    magnitude, phase = figure.subplots(2, 1, sharex=True)
    bode_lines(magnitude, phase, FREQUENCIES, plain, "without notch", color=RED, linestyle="--")
    bode_lines(magnitude, phase, FREQUENCIES, plain * filter_, "with notch", color=BLUE)
    bode_lines(magnitude, phase, FREQUENCIES, filter_, "notch filter alone", color=GREY, linewidth=0.7)
    label_bode(magnitude, phase, FREQUENCIES)
    peaks = {}
    for name, low, high, side in (("first", 14.0, 17.5, "right"), ("second", 18.5, 21.0, "left")):
        index = peak(FREQUENCIES, plain, low, high)
        at = float(FREQUENCIES[index])
        peaks[name] = [float(bode(response)[0][index]) for response in (plain, plain * filter_)]
        for axis in (magnitude, phase):
            axis.axvline(at, color=GREY, linewidth=0.5, linestyle=":")
        magnitude.annotate(
            f"{name} mode",
            (at, 1.01),
            xycoords=("data", "axes fraction"),
            va="bottom",
            ha=side,
            fontsize=8,
        )
    magnitude.legend(loc="lower left")
    ticks = (5, 7, 10, 15, 20, 30, 50)
    phase.set_xticks(ticks, [str(t) for t in ticks], minor=False)
    phase.set_xticks([], minor=True)
    return Drawing(
        figure,
        "Elevator to pitch rate, coupled model with the paper-like coupling where Case 1 starts; notch at "
        f"{section[0].zero_frequency:g} rad/s.",
        f"At the first mode the gain falls by {peaks['first'][0] - peaks['first'][1]:.0f} dB; the second, at the edge "
        f"of the notch, by {peaks['second'][0] - peaks['second'][1]:.0f} dB.",
        "The centre is 15 rad/s, the value of the paper's Figure 3, and not the mode itself (15.88 rad/s): a dip at "
        "15 rad/s and a small peak at the mode remain beside each other. The lower centre serves the derived coupling "
        "too, whose first mode is lower.",
    )


FIGURE = PaperFigure(5, "Bode diagram of Notch filter on flexible modes.", draw)

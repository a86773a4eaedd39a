"""Figures of models and filters: Bode diagrams (2, 3, 5, 8) and open-loop poles (4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.units import FOOT
from hsv.control.notch_filter import notch_response
from hsv.model.lpv.linearisation import bode, frequency_response, linearise, zero_order_hold
from hsv.model.signals import PITCH_RATE
from hsv.model.vehicle import load_vehicle
from hsv_paper import plots
from hsv_paper.designs import (
    BETWEEN,
    CODESIGN_FREQUENCIES,
    codesigned_model,
    design,
    extended_model,
    inputs_of,
)
from hsv_paper.figures.figure import PaperFigure
from hsv_paper.linear_loop import ELEVATOR
from hsv_paper.modes import elastic_modes, linearised, pitch_rate_response

POLE_FREQUENCIES = (10.0, 15.0, 20.0)
POLE_DAMPINGS = (0.2, 0.5, 0.8)
"""Poles of the notch filters in Figure 3."""

_BETWEEN = f"{BETWEEN[0] / FOOT:.0f} ft and {BETWEEN[1] / FOOT:.0f} ft/s"
_POLYTOPIC: dict[str, Any] = {"color": plots.BLUE, "linestyle": ":", "linewidth": 2.0}
_WITHOUT = {"color": plots.RED, "linestyle": "--"}


def figure_02() -> Figure:
    """Draw elevator to pitch rate of the polytopic model and of the decoupled model, between the samples."""
    flown, frequencies = design("baseline"), np.logspace(-2.0, 2.0, 600)
    exact = zero_order_hold(*linearise(load_vehicle().decoupled, *BETWEEN), flown.period)
    polytopic = flown.polytope.at(*BETWEEN)
    curves = ((exact, "DM", {"color": plots.RED}), (polytopic, "Polytopic LPV", _POLYTOPIC))
    return _compared(frequencies, flown.period, *curves)


def figure_03() -> Figure:
    """Draw elevator to filtered pitch rate of the coupled model, one parameter of the poles changed at a time."""
    section, frequencies = design("baseline").notch[0], np.logspace(0.0, 2.0, 1500)
    plain = pitch_rate_response("paper_like", frequencies)
    figure = plots.new_figure(5.2)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    families = (
        [(f"$\\omega_p$ = {w:g} rad/s", replace(section, pole_frequency=w)) for w in POLE_FREQUENCIES],
        [(f"$\\varepsilon_p$ = {e:g}", replace(section, pole_damping=e)) for e in POLE_DAMPINGS],
    )
    for (magnitude, phase), family in zip(grid.T, families, strict=True):
        filtered = [
            (plain * notch_response([changed], frequencies), label, {"color": color})
            for (label, changed), color in zip(family, (plots.GREEN, plots.BLUE, plots.ORANGE), strict=True)
        ]
        plots.draw_bode(magnitude, phase, frequencies, [(plain, "without notch", _WITHOUT), *filtered])
        magnitude.legend(loc="lower left")
    for axis in grid[:, 1]:
        axis.set_ylabel("")
    plots.letter(grid[0])
    grid[0, 0].set_title(f"  effect of $\\omega_p$, $\\varepsilon_p$ = {section.pole_damping:g}", loc="right")
    grid[0, 1].set_title(f"  effect of $\\varepsilon_p$, $\\omega_p$ = {section.pole_frequency:g} rad/s", loc="right")
    return figure


def figure_04() -> Figure:
    """Draw all poles of the coupled model, and those near the origin enlarged, for both sets of coupling."""
    figure = plots.new_figure(4.2)
    whole, near = figure.subplots(1, 2, width_ratios=(1.5, 1))
    for name, color, marker, offset, side in (
        ("paper_like", plots.BLUE, "x", (12, -10), "left"),
        ("derived", plots.RED, "+", (-9, -3), "right"),
    ):
        poles, style = _poles(name), {"color": color, "markersize": 7, "markeredgewidth": 1.4}
        for axis in (whole, near):
            axis.plot(poles.real, poles.imag, marker, label=f"{name.replace('_', '-')} coupling", **style)
        for mode in elastic_modes(name).values():
            text = f"{mode.natural_frequency:.2f} rad/s, $\\zeta$ = {mode.damping_ratio:.4f}"
            at, near_to = (mode.pole.real, mode.pole.imag), {"textcoords": "offset points", "ha": side}
            whole.annotate(text, at, offset, color=color, fontsize=8, **near_to)
    structural = load_vehicle().decoupled
    frequencies = (structural.natural_frequency_1, structural.natural_frequency_2)
    for omega in frequencies:
        whole.axhline(omega, color=plots.GREY, linewidth=0.5, linestyle=":")
        whole.text(2.55, omega + 0.3, f"structural {omega:g} rad/s", color=plots.GREY, fontsize=7, ha="right")
    whole.set_xlim(-2.4, 2.6)
    near.set_xlim(-0.02, 0.02)
    near.set_ylim(-0.1, 0.1)
    rigid = sorted((p for p in _poles("paper_like") if abs(p) < 5.0), key=lambda p: -abs(p.real))
    label = {"textcoords": "offset points", "fontsize": 8}
    for pole in rigid[:2]:
        whole.annotate(f"{pole.real:+.2f}", (pole.real, 0.0), (0, 8), ha="center", **label)
    for pole in rigid[2:]:
        text = (
            f"{pole.real:+.4f}{pole.imag:+.3f}j" if pole.imag else f"|s| < {10.0 ** np.ceil(np.log10(abs(pole))):.0e}"
        )
        near.annotate(text, (pole.real, pole.imag), (10, -3), **label)
    for axis in (whole, near):
        axis.axvline(0.0, color="black", linewidth=0.5)
        axis.set_xlabel("Real part (1/s)")
    whole.set_ylabel("Imaginary part (rad/s)")
    whole.legend(loc="center left", bbox_to_anchor=(0.0, 0.38))
    plots.letter((whole, near))
    near.set_title("near the origin", loc="right")
    return figure


def figure_05() -> Figure:
    """Draw elevator to pitch rate about both modes, with and without the design's filter, and its gain alone."""
    section, frequencies = design("baseline").notch, np.logspace(0.7, 1.7, 3000)
    plain, filter_ = pitch_rate_response("paper_like", frequencies), notch_response(section, frequencies)
    figure, magnitude, phase = plots.bode_panels()
    curves = (plain, "without notch", _WITHOUT), (plain * filter_, "with notch", {"color": plots.BLUE})
    plots.draw_bode(magnitude, phase, frequencies, curves)
    alone = {"color": plots.GREY, "linewidth": 0.7, "label": "gain of the notch filter alone"}
    magnitude.semilogx(frequencies, bode(filter_)[0], **alone)
    modes = {name: mode.natural_frequency for name, mode in elastic_modes("paper_like").items()}
    for (name, frequency), side in zip(modes.items(), ("right", "left"), strict=True):
        for axis in (magnitude, phase):
            axis.axvline(frequency, **plots.DOTTED_GREY | {"linewidth": 0.5})
        place: Any = {"xycoords": ("data", "axes fraction"), "va": "bottom", "ha": side}
        magnitude.annotate(f"{name} mode, {frequency:.2f} rad/s", (frequency, 1.01), fontsize=8, **place)
    magnitude.legend(loc="lower left")
    ticks = (5, 7, 10, 15, 20, 30, 50)
    phase.set_xticks(ticks, [str(t) for t in ticks], minor=False)
    phase.set_xticks([], minor=True)
    return figure


def figure_08() -> Figure:
    """Draw elevator to filtered pitch rate of the co-designed model and of the ECM without and with its coupling."""
    inputs = inputs_of("adjustable")
    curves = (
        (extended_model(inputs, "paper_like"), "ECM with its coupling", {"color": plots.GREY, "linewidth": 0.8}),
        (extended_model(inputs, 0.0), "ECM, coupling ignored", {"color": plots.RED}),
        (codesigned_model(inputs), "Codesigned polytopic LPV", _POLYTOPIC),
    )
    return _compared(CODESIGN_FREQUENCIES, inputs.model.period, *curves)


def _compared(
    frequencies: np.ndarray, period: float, *models: tuple[tuple[np.ndarray, np.ndarray], str, dict[str, Any]]
) -> Figure:
    """Return a figure of elevator to pitch rate of discrete models (A and B, label, style)."""
    figure, magnitude, phase = plots.bode_panels()
    drawn = [frequency_response(*model, frequencies, period)[:, PITCH_RATE, ELEVATOR] for model, *_ in models]
    curves = [(response, label, style) for response, (_, label, style) in zip(drawn, models, strict=True)]
    plots.draw_bode(magnitude, phase, frequencies, curves)
    plots.letter((magnitude, phase))
    magnitude.legend(loc="upper right")
    return figure


def _poles(coupling: str) -> np.ndarray:
    return np.linalg.eigvals(linearised(coupling)[0]).astype(complex)


FIGURES = (
    PaperFigure(
        2,
        "Bode diagram comparison of polytopic LPV and DM. (a) Amplitude frequency characteristic. (b) Phase frequency "
        "characteristic.",
        figure_02,
        f"The response is from elevator deflection to pitch rate at {_BETWEEN}, between the samples of the model. Both "
        "models are discrete, with the period of the design.",
        "The two lines overlap.",
        "The paper does not say which point, input and output it shows. Both lines belong to the decoupled model, so "
        "the comparison says nothing about the effect of the neglected coupling (Figure 4).",
    ),
    PaperFigure(
        3,
        "Bode diagram of notch filter's effect on flexible hypersonic vehicle. (a) Effect of omega_p when epsilon_p = "
        "0.5. (b) Effect of epsilon_p when omega_p = 15.",
        figure_03,
        "The response is from elevator to filtered pitch rate of the coupled model, with the paper-like coupling, "
        "where Case 1 starts. The zeros are those of the design's filter.",
        "The filter suppresses the peak of the first mode. A larger damping of the poles widens the notch.",
        "The filter also acts away from its centre: below, it costs phase. If omega_p differs from omega_z, the gain "
        "above the notch changes by (omega_p/omega_z)^2, 2.4 dB per 15 %; both should be moved together. The paper "
        "gives neither its zeros nor the channel that it shows.",
    ),
    PaperFigure(
        4,
        "Open-loop pole distribution.",
        figure_04,
        "The figure shows the poles of the coupled model linearised where Case 1 starts (85500 ft, 7900 ft/s), for "
        "both sets of inertial coupling.",
        "There are five poles of the rigid body and two lightly damped pairs, the paper's seven motion modes. With the "
        "paper-like coupling, the pairs are close to the structural frequencies. The rigid body is unstable.",
        "With the coupling derived from a beam model, the first pair is not close to its structural frequency: the "
        "paper-like set is a quarter of the derived one in order to agree with the paper's statement. The number seven "
        "counts the slow pair of the rigid body as two modes.",
    ),
    PaperFigure(
        5,
        "Bode diagram of Notch filter on flexible modes.",
        figure_05,
        "The response is from elevator to pitch rate of the coupled model, with the paper-like coupling, where Case 1 "
        "starts, without and with the design's filter.",
        "The peak near the first mode falls far; that of the second mode, at the edge of the notch, falls partially.",
        "The notch is centred at the value of the paper's Figure 3, and not at the mode itself, so that a dip at the "
        "centre and a small peak at the mode remain next to each other. The lower centre also suits the derived "
        "coupling, whose first mode is lower.",
    ),
    PaperFigure(
        8,
        "Bode diagram comparison of codesigned polytopic LPV model and ECM. (a) Amplitude frequency characteristics. "
        "(b) Phase frequency characteristics.",
        figure_08,
        f"The response is from elevator deflection to filtered pitch rate at {_BETWEEN}, between the samples of the "
        "model.",
        "The co-designed model, which includes the notch, agrees with the ECM without its coupling.",
        "With the ECM as the paper writes it, including the coupling (grey, paper-like), the co-designed model agrees "
        "only below the elastic modes. No control-oriented model of the paper contains these modes: neglecting the "
        "weak coupling is part of the design, and the price is that stability with flexibility must be shown by other "
        "means.",
    ),
)
"""Figures 2 to 5, and 8."""

"""Figures of models and filters: Bode diagrams (2, 3, 5, 8) and open-loop poles (4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.certificate.loops import ELEVATOR
from hsv.control.notch_filter import notch_response
from hsv.model.lpv.linearisation import bode, frequency_response, linearise, zero_order_hold
from hsv.model.signals import PITCH_RATE
from hsv.model.vehicle import load_vehicle
from hsv_paper import plots
from hsv_paper.designs import BETWEEN, CODESIGN_FREQUENCIES, codesigned_model, design, extended_model, inputs_of
from hsv_paper.modes import elastic_modes, linearised, pitch_rate_response

POLE_FREQUENCIES = (10.0, 15.0, 20.0)
POLE_DAMPINGS = (0.2, 0.5, 0.8)
"""Frequencies (rad/s) and damping ratios of the notch filter's poles in Figure 3."""

_POLYTOPIC: dict[str, Any] = {"color": plots.BLUE, "linestyle": ":", "linewidth": 2.0}
_WITHOUT = {"color": plots.RED, "linestyle": "--"}


def figure_02() -> Figure:
    """Draw the Bode diagram, elevator to pitch rate, of the polytopic and the decoupled model at :data:`BETWEEN`."""
    flown, frequencies = design("baseline"), np.logspace(-2.0, 2.0, 600)
    exact = zero_order_hold(*linearise(load_vehicle().decoupled, *BETWEEN), flown.period)
    polytopic = flown.polytope.at(*BETWEEN)
    curves = ((exact, "DM", {"color": plots.RED}), (polytopic, "Polytopic LPV", _POLYTOPIC))
    return _compared(frequencies, flown.period, *curves)


def figure_03() -> Figure:
    """Draw the Bode diagram of the coupled model with filtered pitch rate, for several poles of the notch filter.

    The left panels vary the frequency of the poles, the right panels their damping.
    """
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
    """Draw all poles of the coupled model, for paper-like and derived coupling, also enlarged near the origin."""
    figure = plots.new_figure(4.2)
    whole, near = figure.subplots(1, 2, width_ratios=(1.5, 1))
    for name, color, marker, offset, side in (
        ("paper_like", plots.BLUE, "x", (12, -10), "left"),
        ("derived", plots.RED, "+", (-9, -3), "right"),
    ):
        poles, style = np.linalg.eigvals(linearised(name)[0]), {"color": color, "markersize": 7, "markeredgewidth": 1.4}
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
    for axis in (whole, near):
        axis.axvline(0.0, color="black", linewidth=0.5)
        axis.set_xlabel("Real part (1/s)")
    whole.set_ylabel("Imaginary part (rad/s)")
    whole.legend(loc="center left", bbox_to_anchor=(0.0, 0.38))
    plots.letter((whole, near))
    near.set_title("near the origin", loc="right")
    return figure


def figure_05() -> Figure:
    """Draw the Bode diagram, elevator to pitch rate, near the elastic modes, with and without the notch filter."""
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
    """Draw the Bode diagram, elevator to filtered pitch rate, of the co-designed and the extended coupled model.

    The latter (ECM, eq. 40) is drawn with its coupling and without.
    """
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
    """Return the Bode diagram, elevator to pitch rate, of discrete models, each given as (A, B), label and style."""
    figure, magnitude, phase = plots.bode_panels()
    drawn = [frequency_response(*model, frequencies, period)[:, PITCH_RATE, ELEVATOR] for model, *_ in models]
    curves = [(response, label, style) for response, (_, label, style) in zip(drawn, models, strict=True)]
    plots.draw_bode(magnitude, phase, frequencies, curves)
    plots.letter((magnitude, phase))
    magnitude.legend(loc="upper right")
    return figure


FIGURES = {2: figure_02, 3: figure_03, 4: figure_04, 5: figure_05, 8: figure_08}

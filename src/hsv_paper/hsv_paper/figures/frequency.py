"""Figures of models and filters: Bode diagrams (2, 3, 5, 8) and open-loop poles (4)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hsv.base.units import FOOT
from hsv.control.notch_filter import notch_response
from hsv.model.lpv.linearisation import bode, bode_difference, frequency_response, linearise, zero_order_hold
from hsv.model.signals import PITCH_RATE
from hsv.model.vehicle import load_vehicle
from hsv_paper import plots
from hsv_paper.designs import (
    BETWEEN,
    CODESIGN_FREQUENCIES,
    certificate,
    codesigned_model,
    design,
    extended_model,
    inputs_of,
)
from hsv_paper.figures.figure import paper_figure
from hsv_paper.flights import Flights
from hsv_paper.linear_loop import ELEVATOR
from hsv_paper.modes import PeakFall, elastic_modes, linearised, open_loop_modes, peak_falls, pitch_rate_response
from hsv_paper.study import Outcome

POLE_FREQUENCIES = (10.0, 15.0, 20.0)
POLE_DAMPINGS = (0.2, 0.5, 0.8)
"""Poles of the notch filters in Figure 3."""

_BETWEEN = f"{BETWEEN[0] / FOOT:.0f} ft and {BETWEEN[1] / FOOT:.0f} ft/s"
_POLYTOPIC: dict[str, Any] = {"color": plots.BLUE, "linestyle": ":", "linewidth": 2.0}
_WITHOUT = {"color": plots.RED, "linestyle": "--"}


@paper_figure(
    2,
    "Bode diagram comparison of polytopic LPV and DM. (a) Amplitude frequency characteristic. (b) Phase frequency "
    "characteristic.",
)
def figure_02(flights: Flights) -> Outcome:
    """Draw elevator to pitch rate of the polytopic model and of the decoupled model, between the samples."""
    flown, model = design("baseline"), certificate("baseline")["model"]
    frequencies = np.logspace(-2.0, 2.0, 600)
    exact = zero_order_hold(*linearise(load_vehicle().decoupled, *BETWEEN), flown.period)
    polytopic = flown.polytope.at(*BETWEEN)
    curves = ((exact, "DM", {"color": plots.RED}), (polytopic, "Polytopic LPV", _POLYTOPIC))
    figure, _ = _compared(frequencies, flown.period, *curves)
    accuracy, (rows, columns) = model["accuracy"], model["vertices"]
    return Outcome(
        figure,
        f"The response is from elevator deflection to pitch rate at {_BETWEEN}, between the samples of the model. Both "
        f"models are discrete with a period of {flown.period:g} s; the polytopic model has {rows * columns} vertices "
        f"({rows} in altitude, {columns} in velocity).",
        "The two lines overlap. Over the whole envelope, for all states and inputs, the Bode plots differ by at most "
        f"{accuracy['bode_magnitude_error_db']:.1g} dB and {accuracy['bode_phase_error_deg']:.1g} deg; at "
        f"{accuracy['points']} points, the matrices differ by at most {accuracy['relative_frobenius_error']:.1g} of "
        "their norm.",
        "The paper does not say which point, input and output it shows. Both lines belong to the decoupled model, so "
        "the comparison says nothing about the effect of the neglected coupling (Figure 4).",
    )


@paper_figure(
    3,
    "Bode diagram of notch filter's effect on flexible hypersonic vehicle. (a) Effect of omega_p when epsilon_p = "
    "0.5. (b) Effect of epsilon_p when omega_p = 15.",
)
def figure_03(flights: Flights) -> Outcome:
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
    lag = float(np.degrees(np.angle(notch_response([section], np.array([5.0]))[0])))
    return Outcome(
        figure,
        "The response is from elevator to filtered pitch rate of the coupled model, with the paper-like coupling, "
        f"where Case 1 starts. The zeros are at {section.zero_frequency:g} rad/s, with a damping of "
        f"{section.zero_damping:g}.",
        f"With the design's filter, the peak of the first mode {_fall_in_words(peak_falls([section])['first'])}. A "
        "larger damping of the poles widens the notch.",
        f"The filter also acts away from its centre: at 5 rad/s it costs {-lag:.0f} deg of phase. If omega_p differs "
        "from omega_z, the gain above the notch changes by (omega_p/omega_z)^2, 2.4 dB per 15 %; both should be moved "
        "together. The paper gives neither its zeros nor the channel that it shows.",
    )


@paper_figure(4, "Open-loop pole distribution.")
def figure_04(flights: Flights) -> Outcome:
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
    slow = [mode for mode in open_loop_modes("paper_like") if mode.natural_frequency < 5.0]
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
    like, derived = (
        [f"{mode.natural_frequency:.2f}" for mode in elastic_modes(name).values()] for name in ("paper_like", "derived")
    )
    return Outcome(
        figure,
        "The figure shows the poles of the coupled model linearised where Case 1 starts (85500 ft, 7900 ft/s), for "
        "both sets of inertial coupling.",
        f"There are {len(rigid)} poles of the rigid body and {len(like)} lightly damped pairs, the paper's seven "
        f"motion modes. With the paper-like coupling, the pairs are at {' and '.join(like)} rad/s, close to the "
        f"structural frequencies of {' and '.join(f'{omega:g}' for omega in frequencies)} rad/s. The rigid body is "
        f"unstable, with a pole at {max(pole.real for pole in rigid):+.2f} 1/s.",
        f"With the coupling derived from a beam model, the pairs are at {' and '.join(derived)} rad/s, not close to "
        f"the structural frequencies: the paper-like set is {load_vehicle().coupling_scale('paper_like'):g} times the "
        "derived one in order to agree with the paper's statement. The number seven counts the slow pair of the rigid "
        f"body as two modes; counted as one, the rigid body has {len(slow)} modes.",
    )


@paper_figure(5, "Bode diagram of Notch filter on flexible modes.")
def figure_05(flights: Flights) -> Outcome:
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
    first, second = (_fall_in_words(fall) for fall in peak_falls(section).values())
    return Outcome(
        figure,
        "The response is from elevator to pitch rate of the coupled model, with the paper-like coupling, where Case 1 "
        f"starts; the notch is at {section[0].zero_frequency:g} rad/s.",
        f"The peak near the first mode {first}; the peak of the second mode, at the edge of the notch, {second}.",
        f"The notch is centred at {section[0].zero_frequency:g} rad/s, the value of the paper's Figure 3, and not at "
        f"the mode itself ({modes['first']:.2f} rad/s), so that a dip at the centre and a small peak at the mode "
        "remain next to each other. The lower centre also suits the derived coupling, whose first mode is lower, at "
        f"{elastic_modes('derived')['first'].natural_frequency:.2f} rad/s.",
    )


@paper_figure(
    8,
    "Bode diagram comparison of codesigned polytopic LPV model and ECM. (a) Amplitude frequency characteristics. "
    "(b) Phase frequency characteristics.",
)
def figure_08(flights: Flights) -> Outcome:
    """Draw elevator to filtered pitch rate of the co-designed model and of the ECM without and with its coupling."""
    inputs, model, frequencies = inputs_of("adjustable"), certificate("adjustable")["model"], CODESIGN_FREQUENCIES
    curves = (
        (extended_model(inputs, "paper_like"), "ECM with its coupling", {"color": plots.GREY, "linewidth": 0.8}),
        (extended_model(inputs, 0.0), "ECM, coupling ignored", {"color": plots.RED}),
        (codesigned_model(inputs), "Codesigned polytopic LPV", _POLYTOPIC),
    )
    figure, drawn = _compared(frequencies, inputs.model.period, *curves)
    decibel, degree = bode_difference(drawn[-1], drawn[0])
    loud, late = np.argmax(decibel), np.argmax(degree)
    elastic = [f"{mode.natural_frequency:.1f}" for mode in elastic_modes("paper_like").values()]
    accuracy, (rows, columns) = model["accuracy"], model["vertices"]
    return Outcome(
        figure,
        f"The response is from elevator deflection to filtered pitch rate at {_BETWEEN}, between the samples of the "
        f"model. All models are discrete with a period of {inputs.model.period:g} s; the co-designed model has "
        f"{rows * columns} vertices ({rows} in altitude, {columns} in velocity).",
        "The co-designed model, which includes the notch, agrees with the ECM without its coupling. Over the whole "
        f"envelope, for all states and inputs, they differ by at most {accuracy['bode_magnitude_error_db']:.2f} dB and "
        f"{accuracy['bode_phase_error_deg']:.2f} deg; at {accuracy['points']} points, the matrices differ by at most "
        f"{accuracy['relative_frobenius_error']:.1g} of their norm.",
        "With the ECM as the paper writes it, including the coupling (grey, paper-like), the co-designed model agrees "
        f"only below the elastic modes: the lines differ by up to {decibel[loud]:.1f} dB (at {frequencies[loud]:.1f} "
        f"rad/s) and {degree[late]:.0f} deg (at {frequencies[late]:.1f} rad/s), near the modes at "
        f"{' and '.join(elastic)} rad/s. No control-oriented model of the paper contains these modes: neglecting the "
        "weak coupling is part of the design, and the price is that stability with flexibility must be shown by other "
        "means.",
    )


def _compared(
    frequencies: np.ndarray, period: float, *models: tuple[tuple[np.ndarray, np.ndarray], str, dict[str, Any]]
) -> tuple[Figure, list[np.ndarray]]:
    """Draw elevator to pitch rate of discrete models (A and B, label, style); return the figure and the responses."""
    figure, magnitude, phase = plots.bode_panels()
    drawn = [frequency_response(*model, frequencies, period)[:, PITCH_RATE, ELEVATOR] for model, *_ in models]
    curves = [(response, label, style) for response, (_, label, style) in zip(drawn, models, strict=True)]
    plots.draw_bode(magnitude, phase, frequencies, curves)
    plots.letter((magnitude, phase))
    magnitude.legend(loc="upper right")
    return figure, drawn


def _poles(coupling: str) -> np.ndarray:
    return np.linalg.eigvals(linearised(coupling)[0]).astype(complex)


def _fall_in_words(fall: PeakFall) -> str:
    """Return in words how far a filter lowers the peak of a mode."""
    start = f"falls from {fall.before.magnitude:.1f} dB at {fall.before.frequency:.2f} rad/s"
    if fall.after is None:
        return f"{start} so far that no peak remains"
    end = f"to {fall.after.magnitude:.1f} dB at {fall.after.frequency:.2f} rad/s"
    return f"{start} {end}, by {fall.decibel:.1f} dB peak to peak"

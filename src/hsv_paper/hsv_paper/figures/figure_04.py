"""Figure 4: the open-loop poles of the coupled model."""

from __future__ import annotations

import numpy as np

from hsv.model.dynamics import VehicleParameters, jacobian
from hsv.model.lpv.linearisation import modes
from hsv.model.trim import trim
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.figure import Drawing, Material, PaperFigure
from hsv_paper.figures.style import BLUE, GREY, RED, letter, new_figure
from hsv_paper.linear_loop import START
from hsv_paper.mode_peaks import elastic_modes

SETS = (("paper_like", "paper-like coupling", BLUE, "x"), ("derived", "derived coupling", RED, "+"))


def draw(material: Material) -> Drawing:
    """Draw all poles, and those near the origin closer, for both sets of coupling."""
    figure = new_figure(4.2)
    whole, near = figure.subplots(1, 2, width_ratios=(1.5, 1))
    for name, label, color, marker in SETS:
        vehicle = load_vehicle().coupled(name)
        poles = _poles(vehicle)
        for axis in (whole, near):
            axis.plot(poles.real, poles.imag, marker, color=color, markersize=7, markeredgewidth=1.4, label=label)
        for mode in elastic_modes(name).values():
            text = f"{mode.natural_frequency:.2f} rad/s, $\\zeta$ = {mode.damping_ratio:.4f}"
            right = name == "paper_like"
            whole.annotate(
                text,
                (mode.pole.real, mode.pole.imag),
                (12, -10) if right else (-9, -3),
                textcoords="offset points",
                ha="left" if right else "right",
                color=color,
                fontsize=8,
            )
    structural = load_vehicle().decoupled
    frequencies = (structural.natural_frequency_1, structural.natural_frequency_2)
    for omega in frequencies:
        whole.axhline(omega, color=GREY, linewidth=0.5, linestyle=":")
        whole.text(2.55, omega + 0.3, f"structural {omega:g} rad/s", color=GREY, fontsize=7, ha="right")
    whole.set_xlim(-2.4, 2.6)
    near.set_xlim(-0.02, 0.02)
    near.set_ylim(-0.1, 0.1)
    slow = [mode for mode in modes(_matrix(load_vehicle().coupled("paper_like"))) if mode.natural_frequency < 5.0]
    rigid = sorted(
        (p for p in _poles(load_vehicle().coupled("paper_like")) if abs(p) < 5.0), key=lambda p: -abs(p.real)
    )
    for pole in rigid[:2]:
        whole.annotate(
            f"{pole.real:+.2f}", (pole.real, 0.0), (0, 8), textcoords="offset points", ha="center", fontsize=8
        )
    for pole in rigid[2:]:
        text = (
            f"{pole.real:+.4f}{pole.imag:+.3f}j" if pole.imag else f"|s| < {10.0 ** np.ceil(np.log10(abs(pole))):.0e}"
        )
        near.annotate(text, (pole.real, pole.imag), (10, -3), textcoords="offset points", fontsize=8)
    for axis in (whole, near):
        axis.axvline(0.0, color="black", linewidth=0.5)
        axis.set_xlabel("Real part (1/s)")
    whole.set_ylabel("Imaginary part (rad/s)")
    whole.legend(loc="center left", bbox_to_anchor=(0.0, 0.38))
    letter((whole, near))
    near.set_title("near the origin", loc="right")
    like, derived = ([f"{m.natural_frequency:.2f}" for m in elastic_modes(name).values()] for name, *_ in SETS)
    share = load_vehicle().coupling_scale("paper_like")
    fast = max(pole.real for pole in rigid)
    return Drawing(
        figure,
        "The figure shows the poles of the coupled model linearised where Case 1 starts (85500 ft, 7900 ft/s), for "
        "both sets of inertial coupling.",
        f"There are {len(rigid)} poles of the rigid body and {len(like)} lightly damped pairs, the paper's seven "
        f"motion modes. With the paper-like coupling, the pairs are at {' and '.join(like)} rad/s, close to the "
        f"structural frequencies of {' and '.join(f'{omega:g}' for omega in frequencies)} rad/s. The rigid body is "
        f"unstable, with a pole at {fast:+.2f} 1/s.",
        f"With the coupling derived from a beam model, the pairs are at {' and '.join(derived)} rad/s, not close to "
        f"the structural frequencies: the paper-like set is {share:g} times the derived one in order to agree with the "
        "paper's statement. The number seven counts the slow pair of the rigid body as two modes; counted as one, the "
        f"rigid body has {len(slow)} modes.",
    )


def _matrix(vehicle: VehicleParameters) -> np.ndarray:
    point = trim(vehicle, *START)
    return jacobian(point.state, point.input, vehicle)[0]


def _poles(vehicle: VehicleParameters) -> np.ndarray:
    return np.linalg.eigvals(_matrix(vehicle)).astype(complex)


FIGURE = PaperFigure(4, "Open-loop pole distribution.", draw)

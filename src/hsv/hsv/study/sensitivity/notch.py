"""Where the notch filter may be, and how deep it has to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from hsv.control.notch_filter import NotchSection
from hsv.study.figures.style import BLUE, GREY, RED, letter, new_figure, plain_log
from hsv.study.sensitivity.controllers import WITH_NOTCH, flown, growth
from hsv.study.sensitivity.study import Outcome, Progress, Study, grid
from hsv.vehicle.parameters import vehicle_parameters

POLE_DAMPING = 0.5
"""Of all filters looked at: a zero damping as large makes the filter none."""

SETS = (("paper_like", "paper-like coupling", BLUE), ("derived", "derived coupling", RED))


def run(coarseness: float, folder: Path, progress: Progress) -> Outcome:
    """Linearise the loop over centre and depth, and fly it over the centre, for both sets of coupling."""
    centres = grid(8.0, 26.0, 0.5, coarseness)
    depths = np.geomspace(0.005, 0.5, max(3, round(17 / coarseness)))
    maps = {}
    total = len(SETS) * len(centres)
    for number, (name, _, _) in enumerate(SETS):
        vehicle, rows = vehicle_parameters(name), []
        for index, centre in enumerate(centres):
            progress("notch, linear", number * len(centres) + index, total)
            sections = [NotchSection(float(centre), float(depth), float(centre), POLE_DAMPING) for depth in depths]
            rows.append([growth(WITH_NOTCH, vehicle, notch=[section]) for section in sections])
        maps[name] = np.array(rows)
    progress("notch, linear", total, total)
    decays = {name: _decays(name, centres, progress) for name, _, _ in SETS}

    figure = new_figure(6.4)
    grid_spec = figure.add_gridspec(2, 2)
    levels = np.array([-0.4, -0.3, -0.2, -0.1, 0.0, 0.25, 0.5, 1.0, 1.5])
    panels: list[Axes] = []
    for column, (name, label, _) in enumerate(SETS):
        axis = figure.add_subplot(grid_spec[0, column], sharey=panels[0] if panels else None)
        shown = axis.contourf(
            centres, depths, maps[name].T, levels=levels, cmap="RdYlBu_r", extend="both", vmin=-1.0, vmax=1.0
        )
        axis.contour(centres, depths, maps[name].T, levels=[0.0], colors="black", linewidths=1.2)
        axis.plot(15.0, 0.02, "k+", markersize=8)
        plain_log(axis)
        axis.set_title(label, loc="right")
        axis.set_xlabel("notch centre (rad/s)")
        axis.grid(visible=False)
        panels.append(axis)
    panels[0].set_ylabel(r"zero damping $\varepsilon_z$ (0.5: no notch)")
    figure.colorbar(shown, ax=panels, label="largest real part (1/s)", aspect=15)
    axis = figure.add_subplot(grid_spec[1, :])
    for name, label, color in SETS:
        axis.plot(centres, decays[name], "o-", color=color, markersize=3, label=label)
    for limit, color in ((12.0, BLUE), (16.0, RED)):
        axis.axhline(limit, color=color, linewidth=0.6, linestyle="--")
    axis.axvline(15.0, color=GREY, linewidth=0.6, linestyle=":")
    axis.set_ylim(0.0, 60.0)
    axis.set_xlabel(r"notch centre (rad/s), $\varepsilon_z$ = 0.02")
    axis.set_ylabel("elastic decay (s)")
    axis.legend(loc="upper right")
    letter((*panels, axis))
    return Outcome(
        figure,
        "(a), (b) Largest real part of the sampled loop's poles over the notch's centre and the damping of its zeros, "
        "nominal vehicle, the worst of both ends of the step, before and after the fault; black: the limit of "
        "stability, cross: the baseline's filter. Zeros and poles share the centre, pole damping 0.5. (c) Decay time "
        "in flight; no point where the flight is lost; dashed: the limits of the scenarios.",
        tuple(_findings(centres, depths, maps, decays)),
        {
            "centre_rad_per_s": centres.tolist(),
            "zero_damping": depths.tolist(),
            "growth_per_s": {name: values.tolist() for name, values in maps.items()},
            "decay_s": {name: values.tolist() for name, values in decays.items()},
        },
    )


def _decays(coupling: str, centres: np.ndarray, progress: Progress) -> np.ndarray:
    found = []
    for index, centre in enumerate(centres):
        progress(f"notch, flights, {coupling}", index, len(centres))
        flown_at = [float(centre)]
        table = flown(
            WITH_NOTCH,
            [{}],
            vehicle__coupling=coupling,
            notch__flown__zero_frequency=flown_at,
            notch__flown__pole_frequency=flown_at,
        )
        lost = table["diverged"][0] > 0.0 or "elastic_decay_time" not in table
        found.append(np.nan if lost else float(table["elastic_decay_time"][0]))
    progress(f"notch, flights, {coupling}", len(centres), len(centres))
    return np.array(found)


def _findings(
    centres: np.ndarray, depths: np.ndarray, maps: dict[str, np.ndarray], decays: dict[str, np.ndarray]
) -> list[str]:
    said = []
    deep = int(np.argmin(np.abs(depths - 0.02)))
    for name, label, _ in SETS:
        stable = centres[maps[name][:, deep] < 0.0]
        span = f"at {stable.min():.1f} to {stable.max():.1f} rad/s" if len(stable) else "nowhere"
        if len(stable) == len(centres):
            span = f"wherever it was put, {centres[0]:g} to {centres[-1]:g} rad/s,"
        at = int(np.argmin(np.abs(centres - 15.0)))
        shallow = depths[maps[name][at] < 0.0]
        limit = f"up to a zero damping of {shallow.max():.2g}" if len(shallow) else "at no depth"
        best = np.nanargmin(np.where(np.isnan(decays[name]), np.inf, decays[name]))
        said.append(
            f"{label}: stable with the centre {span} (deep notch), at 15 rad/s {limit}; the shortest decay in "
            f"flight is {decays[name][best]:.1f} s at {centres[best]:.1f} rad/s"
        )
    return said


STUDY = Study("notch", "Centre and depth of the notch filter", run)

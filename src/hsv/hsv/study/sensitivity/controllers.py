"""The controllers that the strips compare, and flying each of them with another vehicle, fault or filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import hadamard

from hsv.control.design_file import ControlDesign, find_design, read_parameters
from hsv.control.notch_filter import NotchSection, flown_sections
from hsv.design.region import Corner
from hsv.simulation.scenario import load_scenario
from hsv.study.corner_flights import Table, fly_over
from hsv.study.figures.style import BLUE, GREEN, ORANGE, RED
from hsv.study.linear_loop import worst_growth
from hsv.vehicle.parameters import VehicleParameters, uncertainty_bounds


@dataclass(frozen=True)
class Controller:
    """A scenario of Case 1 with changes, and its colour in the plots."""

    label: str
    scenario: str
    color: str
    design: str = "baseline"
    changes: tuple[tuple[str, Any], ...] = ()

    def parameters(self) -> dict[str, Any]:
        """Flat parameters of the flight."""
        return {
            **read_parameters(find_design(self.design)),
            **load_scenario(self.scenario).parameters(),
            **dict(self.changes),
        }


WITH_NOTCH = Controller("tube with notch at 15 rad/s", "case1", BLUE)
WIDER_NOTCH = Controller("tube with notch at 14 rad/s, wider", "case1", GREEN, "baseline_derived")
WITHOUT_NOTCH = Controller("tube without notch", "case1_no_notch", ORANGE)
RMPC = Controller("RMPC, fourth gain", "case1_rmpc_fourth_k", RED, changes=(("vehicle.model", "CM"),))

ALL = (WITH_NOTCH, WIDER_NOTCH, WITHOUT_NOTCH, RMPC)

HALF_WIDTH = np.array([1.0, 1.0, 1.0, 1.0, 1.0])
"""The strips use no measure that weighs rigid errors against each other."""


def corners_of(scale: float) -> list[Corner]:
    """Return the nominal vehicle and 32 corners of ``scale`` times the parameter bounds.

    A Hadamard matrix of 16 runs and its mirror image: any three parameters meet in all their combinations.
    """
    names = list(uncertainty_bounds())
    runs = hadamard(16)[:, 1 : 1 + len(names)]
    signs = np.vstack((runs, -runs))
    bounds = np.array(list(uncertainty_bounds().values()))
    return [{}, *(dict(zip(names, map(float, scale * row * bounds), strict=True)) for row in signs)]


def flown(controller: Controller, over: Sequence[Corner], coupling_scale: float | None = None, **changes: Any) -> Table:
    """Return what is measured on the flights of a controller with each vehicle; changed parameters with __ for dots."""
    values = controller.parameters() | {name.replace("__", "."): value for name, value in changes.items()}
    return fly_over(values, over, HALF_WIDTH, coupling_scale=coupling_scale)


def growth(
    controller: Controller,
    vehicle: VehicleParameters,
    *,
    notch: Sequence[NotchSection] | None = None,
) -> float:
    """Return the largest real part (1/s) of the sampled loop's poles, the worst as in :func:`worst_growth`.

    Args:
        controller: Its feedback, and its filter where ``notch`` gives no other.
        vehicle: Coupled or not.
        notch: Sections of the filter.
    """
    gain, own, period = _feedback(controller)
    return worst_growth(vehicle, gain, own if notch is None else notch, period)


@cache
def _feedback(controller: Controller) -> tuple[np.ndarray, tuple[NotchSection, ...], float]:
    """Return gain (2, 9), filter and period (s) of a controller."""
    values = controller.parameters()
    design = ControlDesign.from_parameters(values)
    gain = design.adjusted_gain(design.tau)
    if values["controller"] == "robust_mpc":
        gain = design.nominal_gains[values["robust_mpc.gain_index"]]
    return gain, flown_sections(values) if values["notch.enabled"] else (), design.period

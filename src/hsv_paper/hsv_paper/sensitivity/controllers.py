"""The controllers that the sweeps compare, the vehicles they fly with, and their linear loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import cycle
from typing import Any

import numpy as np

from hsv.control.design import ControlDesign, find_design, read_parameters
from hsv.control.notch_filter import NotchSection, flown_sections
from hsv.flight.assembly import assemble_flight, scenario_parameters
from hsv.flight.corners import Corner, screening_corners
from hsv.flight.scenario import load_scenario
from hsv.model.dynamics import VehicleParameters
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.style import BLUE, GREEN, ORANGE, RED
from hsv_paper.linear_loop import COUPLING_SCALES, critical_coupling, worst_growth

PURPLE = "#7d3c98"


@dataclass(frozen=True)
class Controller:
    """A scenario with changes, and its colour in the plots."""

    label: str
    scenario: str
    color: str
    design: str = "baseline"
    changes: tuple[tuple[str, Any], ...] = ()
    kept: bool = True
    """Whether its flights are kept, because they depend only on the parameters and this library."""

    def parameters(self) -> dict[str, Any]:
        """Flat parameters of the flight."""
        return {
            **(read_parameters(find_design(self.design)) if self.design else {}),
            **scenario_parameters(load_scenario(self.scenario)),
            **dict(self.changes),
        }


WITH_NOTCH = Controller("tube with notch at 15 rad/s", "case1", BLUE)
WIDER_NOTCH = Controller("tube with notch at 14 rad/s, wider", "case1", GREEN, "baseline_derived")
WITHOUT_NOTCH = Controller("tube without notch", "case1_no_notch", ORANGE)

_ON_CM = (("vehicle.model", "CM"),)
RMPC = Controller("RMPC without notch", "case1_rmpc_fourth_k", RED, changes=_ON_CM)
RMPC_WITH_NOTCH = Controller(
    "RMPC, were it given the notch", RMPC.scenario, PURPLE, RMPC.design, (*_ON_CM, ("notch.enabled", True))
)
RMPC_DECOUPLED = Controller("RMPC as the paper flies it, on the decoupled model", RMPC.scenario, RED)

ALL = (WITH_NOTCH, WIDER_NOTCH, WITHOUT_NOTCH, RMPC, RMPC_WITH_NOTCH)

_OTHER_COLORS = ("#008b8b", "#8c564b", "#c71585", "#556b2f")


def of_scenarios(names: Sequence[str]) -> list[Controller]:
    """Return the controllers of scenarios, labelled with their titles.

    Raises:
        ScenarioError: There is no such scenario, or it is not acceptable.
    """
    found = []
    for name, color in zip(names, cycle(_OTHER_COLORS), strict=False):
        scenario = load_scenario(name)
        assemble_flight(scenario)
        found.append(Controller(scenario.title, name, color, scenario.design, kept=False))
    return found


SAID_RMPC = "RMPC flies the fourth gain of the nominal family"
"""Description of the RMPC gain for the pages."""


def corners_of(scale: float, coarseness: float = 1.0) -> list[Corner]:
    """Return the nominal vehicle and 32 corners of ``scale`` times the parameter bounds, fewer if coarse."""
    return screening_corners(load_vehicle().uncertainty, scale)[:: max(1, round(coarseness))]


def said_corners(over: Sequence[Corner]) -> str:
    """Return the number of corners in ``over`` besides the nominal vehicle, and the number of all."""
    return f"{len(over) - 1} of the {2 ** len(load_vehicle().uncertainty)} corners"


@cache
def feedback(controller: Controller) -> tuple[np.ndarray, tuple[NotchSection, ...], float]:
    """Return gain (2, 9), filter and period (s) of a controller's linear loop."""
    values = controller.parameters()
    design = ControlDesign.from_parameters(values)
    gain = design.adjusted_gain(design.tau)
    if values["controller"] == "robust_mpc":
        gain = design.nominal_gains[values["robust_mpc.gain_index"]]
    return gain, flown_sections(values) if values["notch.enabled"] else (), design.period


def growth(
    controller: Controller,
    vehicle: VehicleParameters,
    *,
    notch: Sequence[NotchSection] | None = None,
) -> float:
    """Return the largest real part (1/s) of the sampled loop's poles, over all cases of :func:`worst_growth`.

    Args:
        controller: Controller with the feedback, and with the filter unless ``notch`` gives another.
        vehicle: Coupled or not.
        notch: Sections of the filter.
    """
    gain, own, period = feedback(controller)
    return worst_growth(vehicle, gain, own if notch is None else notch, period)


@dataclass(frozen=True)
class CouplingLimits:
    """kappa at which the linear loop becomes unstable, of the nominal vehicle and of the worst of ``over``."""

    nominal: float | None
    worst: float | None
    over: Sequence[Corner]

    def said(self) -> str:
        """Return both in words."""
        nominal, worst = (
            f"at least κ = {COUPLING_SCALES[-1]:g}" if limit is None else f"κ = {limit:.2f}"
            for limit in (self.nominal, self.worst)
        )
        return (
            f"the linear loop is stable up to {nominal} (nominal vehicle) and {worst} (worst of "
            f"{said_corners(self.over)})"
        )


def coupling_limits(
    gain: np.ndarray, notch: Sequence[NotchSection], period: float, over: Sequence[Corner]
) -> CouplingLimits:
    """Return the limits of a loop; arguments as for :func:`critical_coupling`, ``over`` the nominal vehicle first."""
    return CouplingLimits(critical_coupling(gain, notch, period), critical_coupling(gain, notch, period, over), over)

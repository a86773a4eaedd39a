"""The panels of report and live page: plots over time, with the curves that each shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from hsv.bags.description import ACTUATOR, COMMAND, FILTERED_STATE, NOMINAL, STATE, TUBE_STATUS
from hsv.model.signals import N_RIGID, STATE_NAMES, STATE_UNITS


class Kind(StrEnum):
    """Kind of a curve, which determines its line style; the user can hide some kinds."""

    actual = "actual"
    nominal = "nominal"
    reference = "reference"
    filtered = "filtered"
    actuator = "actuator"
    effector = "effector"
    bound = "bound"


@dataclass(frozen=True)
class Curve:
    """A curve: the sum of a topic's ``fields``, or of one ``column`` of each; ``-`` before a field subtracts it."""

    kind: Kind
    label: str
    topic: str
    fields: tuple[str, ...]
    column: int | None = None

    def value(self, read: Callable[[str], Any]) -> Any:
        """Return the sum of the fields, which ``read`` returns by their path; NaN if a field lacks the column."""
        total: Any = 0.0
        for field in self.fields:
            part: Any = np.asarray(read(field.removeprefix("-")))
            if self.column is not None:
                part = part[..., self.column] if self.column < part.shape[-1] else np.nan
            total = total - part if field.startswith("-") else total + part
        return total


@dataclass(frozen=True)
class Panel:
    """A plot of a quantity, in the SI unit ``unit``, over time."""

    name: str
    title: str
    unit: str
    group: str
    curves: tuple[Curve, ...] = ()
    shading: str = ""
    """Shading in addition to the faults: ``tube`` or the name of an input."""


GROUPS = {
    "requirements": "Requirements",
    "trajectory": "Trajectory",
    "attitude": "Attitude",
    "elastic": "Elastic modes",
    "inputs": "Inputs",
    "sensors": "Sensors: measured less true",
    "air": "Air",
    "tube": "Tube",
}
"""Headings of the groups of panels, in the order of the page."""


def _state(group: str, title: str, unit: str, field: str, *more: Curve) -> Panel:
    curves = (
        Curve(Kind.actual, "vehicle", STATE, (field,)),
        Curve(Kind.nominal, "nominal", NOMINAL, (f"reference.{field}", f"deviation.{field}")),
        Curve(Kind.reference, "reference", NOMINAL, (f"reference.{field}",)),
        *more,
    )
    return Panel(field, title, unit, group, curves)


def _input(title: str, unit: str, field: str) -> Panel:
    curves = (
        Curve(Kind.actual, "command", COMMAND, (field,)),
        Curve(Kind.actuator, "actuator", ACTUATOR, (field,)),
        Curve(Kind.nominal, "nominal", NOMINAL, (f"reference_input.{field}", f"input.{field}")),
        Curve(Kind.reference, "reference", NOMINAL, (f"reference_input.{field}",)),
    )
    return Panel(field, title, unit, "inputs", curves, shading=field)


_FILTERED = Curve(Kind.filtered, "after the notch filter", FILTERED_STATE, ("filtered_pitch_rate",))

PANELS = (
    _state("trajectory", "Altitude h", "m", "altitude"),
    _state("trajectory", "Velocity V", "m/s", "velocity"),
    _state("attitude", "Angle of attack α", "rad", "angle_of_attack"),
    _state("attitude", "Pitch angle θ", "rad", "pitch_angle"),
    _state("attitude", "Pitch rate q", "rad/s", "pitch_rate", _FILTERED),
    _state("elastic", "Elastic coordinate η₁", "kg^0.5 m", "elastic_coordinate_1"),
    _state("elastic", "Elastic coordinate η₂", "kg^0.5 m", "elastic_coordinate_2"),
    _state("elastic", "Elastic rate η̇₁", "kg^0.5 m/s", "elastic_rate_1"),
    _state("elastic", "Elastic rate η̇₂", "kg^0.5 m/s", "elastic_rate_2"),
    _input("Fuel equivalence ratio Φ", "1", "fuel_equivalence_ratio"),
    _input("Elevator deflection δe", "rad", "elevator_deflection"),
    Panel(
        "level",
        "Level of the error in the invariant set",
        "1",
        "tube",
        (Curve(Kind.actual, "level", TUBE_STATUS, ("level",)),),
        shading="tube",
    ),
)
"""The panels of every flight; that of the tube level has a curve only if the design has an invariant set."""

MEASUREMENT_ERRORS = {
    name: Panel(f"measurement_error_{name}", f"Measured less true {name.replace('_', ' ')}", unit, "sensors")
    for name, unit in zip(STATE_NAMES, STATE_UNITS, strict=True)
}
"""Panels of measurement errors, by name of the state; an error is the difference of two topics."""

AIR_PANELS = {
    "wind_forward": Panel("wind_forward", "Wind from behind", "m/s", "air"),
    "wind_up": Panel("wind_up", "Wind from below", "m/s", "air"),
    "density_factor": Panel("density_factor", "Density for that of the model", "1", "air"),
}
"""Panels of wind and density, by name of the message field."""


def error_panel(component: int) -> Panel:
    """Return the panel of component 0, 1, ... of the tube error e: five rigid states, then the notch-filter states."""
    if component < N_RIGID:
        title, unit = f"Error of {STATE_NAMES[component].replace('_', ' ')}", STATE_UNITS[component]
    else:
        number = component - N_RIGID
        title, unit = f"Error of notch state {number + 1}", ("rad", "rad s")[number % 2]
    curves = (
        Curve(Kind.actual, "e", TUBE_STATUS, ("error",), component),
        Curve(Kind.bound, "c − z", TUBE_STATUS, ("tube_centre", "-tube_half_width"), component),
        Curve(Kind.bound, "c + z", TUBE_STATUS, ("tube_centre", "tube_half_width"), component),
    )
    return Panel(f"error_{component + 1}", title, unit, "tube", curves, shading="tube")


LIVE_CURVES = [(panel, curve) for panel in (*PANELS, *map(error_panel, range(N_RIGID))) for curve in panel.curves]
"""Panel and curve of every column of :meth:`hsv.pages.live.hub.Hub.history` after the first, which is the time."""

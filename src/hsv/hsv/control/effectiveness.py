"""Estimator of the elevator effectiveness (``core/effectiveness.h``), an extension of the law, off by default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from hsv.base.parameters import Parameter, validate
from hsv.core import Struct, lib
from hsv.model.dynamics import vehicle_struct
from hsv.model.trim import INITIAL_PARAMETERS, initial_trim
from hsv.model.vehicle import VEHICLE_PARAMETERS, Vehicle

EFFECTIVENESS_ENABLED = Parameter(
    "effectiveness.enabled", False, "true: the elevator command is divided by its estimated effectiveness"
)
_TUNING = (
    Parameter("effectiveness.least", 0.3, "least effectiveness that is estimated", "", 0.1, 0.9),
    Parameter("effectiveness.bound", 0.03, "disturbance of a period, for the elevator's effect", "", 1e-3, 0.5),
    Parameter("effectiveness.offset", 0.08, "largest constant disturbance that is learned, likewise", "", 0.0, 0.5),
    Parameter("effectiveness.time", 1.0, "time constant of learning the constant disturbance", "s", 0.02, 1e3),
    Parameter("effectiveness.drift", 0.01, "by which the interval of the effectiveness widens", "1/s", 0.0, 1.0),
    Parameter(
        "effectiveness.steps", 2.0, "steps that must agree on a fault before it counts", "", 1.0, 5.0, whole=True
    ),
    Parameter("effectiveness.noise", 0.0, "largest error of a measured change of the pitch rate", "rad/s", 0.0, 0.1),
)
EFFECTIVENESS_PARAMETERS = (
    EFFECTIVENESS_ENABLED,
    *(replace(parameter, needs=EFFECTIVENESS_ENABLED.name) for parameter in _TUNING),
)
"""Parameters of the estimator itself; it also needs :data:`WATCHED_PARAMETERS`."""


WATCHED_PARAMETERS = (*INITIAL_PARAMETERS, *VEHICLE_PARAMETERS)
"""Parameters of the nominal vehicle and of the initial trim, which the estimator needs."""


class EffectivenessMode(IntEnum):
    """The estimator's diagnosis of the elevator."""

    HEALTHY = 0
    LOSS = 1
    """A loss of effectiveness explains all steps since the fault."""
    OTHER = 2
    """An offset of the elevator explains all steps since the fault, a loss of effectiveness does not."""
    PENDING = 3
    """The last explanation has failed, and a new one has not yet held for enough steps to replace it."""


class Effectiveness(NamedTuple):
    """The elevator effectiveness after a step: the estimate in use, the interval of possible values, and the mode."""

    estimate: float
    low: float
    high: float
    mode: EffectivenessMode

    def __str__(self) -> str:
        """Return the diagnosis in words."""
        words = {
            EffectivenessMode.HEALTHY: "healthy",
            EffectivenessMode.LOSS: f"effectiveness {self.estimate:.3f}, from {self.low:.3f} to {self.high:.3f}",
            EffectivenessMode.OTHER: "faulty, not a loss of effectiveness",
            EffectivenessMode.PENDING: f"unexplained, effectiveness {self.estimate:.3f} kept",
        }
        return words[self.mode]


def effectiveness_data(values: Mapping[str, Any], period: float) -> Struct | None:
    """Return the estimator as a struct of the core, or None if ``values`` do not enable it; ``period`` is in s."""
    v = validate(EFFECTIVENESS_PARAMETERS, values)
    if not v[EFFECTIVENESS_ENABLED.name]:
        return None
    nominal, start = initial_trim(values)
    bounds = Vehicle.from_parameters(values).uncertainty
    effect = 1.0
    for name in ("moment_elevator", "reference_area", "mean_aerodynamic_chord"):
        effect *= 1.0 + bounds.get(name, 0.0)
    return Struct(
        "hsv_effectiveness",
        vehicle=vehicle_struct(nominal),
        start=start.state.copy(),
        period=period,
        inertia=bounds.get("moment_of_inertia", 0.0),
        effect=min(effect - 1.0, 0.9),
        least=v["effectiveness.least"],
        bound=v["effectiveness.bound"],
        offset=v["effectiveness.offset"],
        learning=min(period / v["effectiveness.time"], 1.0),
        drift=v["effectiveness.drift"] * period,
        noise=v["effectiveness.noise"],
        steps=v["effectiveness.steps"],
    )


def effectiveness_in(memory: np.ndarray) -> Effectiveness:
    """Return the estimated effectiveness in the ``memory`` of the tube law, a record ``hsv_tube_memory``."""
    estimate, low, high = memory["known"][:3].tolist()
    return Effectiveness(estimate, low, high, EffectivenessMode(int(memory["known"][lib.MODE])))

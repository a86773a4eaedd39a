"""Parameters of the estimator, apart from it: every node of a graph asks whether one flies."""

from __future__ import annotations

from hsv.base.parameters import Parameter
from hsv.model.dynamics import INPUT_NAMES, INPUT_UNITS, N_RIGID, STATE_NAMES, STATE_UNITS

ESTIMATOR_ENABLED = Parameter(
    "estimator.enabled", False, "true: the controller receives an estimate instead of the measurement"
)

_DRIVING = (7e-3, 7e-2, 2e-5, 7e-7, 7e-5, 7e-3, 7e-2, 7e-3, 7e-2, 7e-4, 1e-2)
_ESTIMATED = tuple(zip((*STATE_NAMES, *INPUT_NAMES), (*STATE_UNITS, *INPUT_UNITS), strict=True))

NOISE_PARAMETERS = tuple(
    Parameter(f"estimator.noise.{name}", 0.0, "standard deviation of the measurement; 0: the sensor's", unit, 0.0, 1e6)
    for name, unit in _ESTIMATED[:N_RIGID]
)
PROCESS_PARAMETERS = tuple(
    Parameter(
        f"estimator.process.{name}",
        driving,
        "noise that drives the state, after one second" if name in STATE_NAMES else "the same, of the input's offset",
        f"{unit}/s^0.5",
        1e-12,
        1e6,
    )
    for (name, unit), driving in zip(_ESTIMATED, _DRIVING, strict=True)
)
ESTIMATOR_PARAMETERS = (ESTIMATOR_ENABLED, *NOISE_PARAMETERS, *PROCESS_PARAMETERS)

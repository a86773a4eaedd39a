"""Parameters of the estimator of the elevator's effectiveness, apart from it: a scenario is read without it."""

from __future__ import annotations

from hsv.base.parameters import Parameter

EFFECTIVENESS_ENABLED = Parameter(
    "effectiveness.enabled", False, "true: the elevator command is divided by its estimated effectiveness"
)
EFFECTIVENESS_PARAMETERS = (
    EFFECTIVENESS_ENABLED,
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
"""Parameters of the estimator beside those of the vehicle and of the start of the flight."""

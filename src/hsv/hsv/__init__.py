"""Model, design, control and recording of a flexible air-breathing hypersonic vehicle; needs no ROS.

The names for notebooks and scripts are those of :mod:`hsv.api`: ``hsv.load``, ``hsv.fly``, ``hsv.plot`` and so on.
"""

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hsv.api import Flight as Flight
    from hsv.api import LinearModel as LinearModel
    from hsv.api import Scenario as Scenario
    from hsv.api import Trim as Trim
    from hsv.api import compare as compare
    from hsv.api import fly as fly
    from hsv.api import linearise as linearise
    from hsv.api import load as load
    from hsv.api import loop as loop
    from hsv.api import montecarlo as montecarlo
    from hsv.api import plot as plot
    from hsv.api import read_campaign as read_campaign
    from hsv.api import sweep as sweep
    from hsv.api import trim as trim

    __version__: str

# One thread for linear algebra: the matrices are small, and the number of threads changes the last bits of results.
# The variable must be set before numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__all__ = [
    "Flight",
    "LinearModel",
    "Scenario",
    "Trim",
    "compare",
    "fly",
    "linearise",
    "load",
    "loop",
    "montecarlo",
    "plot",
    "read_campaign",
    "sweep",
    "trim",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    # Import the API only when one of its names is used: nodes import this package, but not the whole simulation.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hsv import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

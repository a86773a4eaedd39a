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
    from hsv.api import montecarlo as montecarlo
    from hsv.api import plot as plot
    from hsv.api import sweep as sweep
    from hsv.api import trim as trim

    __version__: str

# All matrices are small: threads in the linear algebra only wait for each other, and their number changes last bits.
# Read once, when numpy is imported.
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
    "montecarlo",
    "plot",
    "sweep",
    "trim",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version(__name__)
    # Only where they are asked for: a node imports this package, and not the whole of the simulation.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hsv import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]

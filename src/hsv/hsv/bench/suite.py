"""All figures of the bench, by name of their group."""

from __future__ import annotations

import os
from collections.abc import Callable

from hsv.bench import campaigns, controllers, graph, in_process, live, offline, startup, writing
from hsv.bench.figure import Figure


def groups(scale: float = 1.0) -> dict[str, Callable[[], list[Figure]]]:
    """Return what can be measured; ``scale`` on the number of repetitions, for a first look."""

    def times(number: int) -> int:
        return max(2, round(scale * number))

    cores = os.cpu_count() or 1
    return {
        "in_process": lambda: in_process.against_c(times(40)),
        "scipy": lambda: in_process.against_scipy(times(10)),
        "jsbsim": lambda: in_process.against_jsbsim(times(10)),
        "controllers": lambda: [*controllers.laws_in_c(times(40)), *controllers.a_step_in_python(times(20))],
        "startup": lambda: startup.against_imports(times(10)),
        "mcap": lambda: writing.against_mcap(times(10)),
        "graph": lambda: graph.against_rings(times(5)),
        "live": lambda: live.watched(times(2)),
        "montecarlo": lambda: [
            *campaigns.over_workers(times(3), max(cores, 2)),
            *campaigns.corners(times(3), max(cores, 2)),
        ],
        "offline": offline.design_and_verify,
    }

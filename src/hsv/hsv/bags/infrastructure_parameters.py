"""Parameters of the nodes' infrastructure: lockstep, pace, recorder and live view.

The tables of :mod:`hsv.graph.node_parameters` also have the parameters of all components, which it has to import.
A node imports only this module and its own component, so that it starts faster.
"""

from __future__ import annotations

from hsv.base.parameters import Parameter
from hsv.control.controller import CONTROLLER_PARAMETERS
from hsv.control.estimator import ESTIMATOR_ENABLED

LOCKSTEP_PARAMETERS = (
    Parameter("recorder", True, "whether the graph has a recorder"),
    *CONTROLLER_PARAMETERS,
    ESTIMATOR_ENABLED,
)
"""Parameters that every node declares."""

STEP_TIMEOUT = 10.0
"""Default wall time (s) after which the plant ends a run because a peer does not answer."""

PACE_PARAMETERS = (
    Parameter(
        "real_time_factor",
        0.0,
        "ratio of simulated to wall time; 0: as fast as possible",
        "",
        0.0,
        1e3,
        read_only=False,
    ),
    Parameter("paused", False, "whether the flight is paused", read_only=False),
    Parameter("start_timeout", 0.0, "wall time to wait for all nodes of the graph; 0: no limit", "s", 0.0, 1e6),
    Parameter("step_timeout", STEP_TIMEOUT, "wall time to wait for a peer within a step", "s", 0.1, 1e6),
    Parameter("progress", False, "print the step to standard output, for a progress bar"),
)
"""Parameters of the plant that control the pace of simulated time."""

RECORDER_PARAMETERS = (
    Parameter("bag.directory", "", "bag to write, a new directory; empty: bags/run_<UTC>"),
    Parameter("bag.attachments", [""], "files to attach"),
    Parameter("bag.custom_data", [""], "key=value pairs for the bag's metadata"),
)

LIVE_PARAMETERS = (
    Parameter("live.port", 8765, "port of the Foxglove WebSocket server; 0: any free one", "", 0, 65535),
    Parameter("live.page_port", 8766, "port of the live page; 0: any free one", "", 0, 65535),
    Parameter("live.title", "", "title of the flight on the live page"),
    Parameter("live.bag", "", "bag of the flight, which the live page names at the end"),
)
"""Parameters of the live view."""

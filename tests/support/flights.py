"""The loop, flown step by step through its component objects, as the nodes do but without messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.blocks import steps
from hsv.flight.closed_loop import Components
from hsv.flight.scenario import load_scenario


def components(scenario: str = "case1", **changes: Any) -> Components:
    """Return the components of a shipped scenario; in names of changed parameters, __ stands for the dot."""
    changed = {name.replace("__", "."): value for name, value in changes.items()}
    return assemble(flight_parameters(load_scenario(scenario)) | changed)


def step_by_step(parts: Components) -> dict[str, np.ndarray]:
    """Fly ``parts`` to the end; return the statuses and the histories (n + 1, ...) by the names of ``History``."""
    rows = [
        {
            "state": signals.state,
            "estimate": signals.estimate,
            "filtered_pitch_rate": signals.filtered_pitch_rate,
            "deviation": signals.deviation,
            "nominal_input": signals.nominal_input,
            "gain_index": signals.gain_index,
            "u_unsaturated": signals.diagnostics.u_unsaturated,
            "command": signals.command,
            "actuator": signals.actuator,
            "saturated": signals.saturated,
            "plant_status": int(signals.status),
            "nominal_status": int(signals.nominal_status),
        }
        for signals in steps(parts)
    ]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}

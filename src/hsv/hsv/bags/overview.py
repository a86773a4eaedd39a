"""Data for viewers that cannot be computed from a single topic: nominal state, bounds of the tube, active faults.

Viewers plot fields and do not add them up; the nominal state is the sum of two, an edge of the tube of four.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from hsv.model.signals import N_RIGID, STATE_NAMES

OVERVIEW_TOPIC = "/hsv/overview"
OVERVIEW_TYPE = "hsv.Overview"

STATES = STATE_NAMES[:N_RIGID]
"""Fields of each of the parts, SI."""

PARTS = ("nominal", "lower", "upper")
"""The edges are there only where there is a tube."""

FAULTS = "faults"
NO_FAULT = "none"

OVERVIEW_SCHEMA: dict[str, Any] = {
    "title": OVERVIEW_TYPE,
    "type": "object",
    "properties": {
        part: {"type": "object", "properties": {name: {"type": "number"} for name in STATES}} for part in PARTS
    }
    | {FAULTS: {"type": "string"}},
}
"""JSON schema of the message."""


def overview_message(
    nominal: np.ndarray, centre: Sequence[float], half_width: Sequence[float], faults: Sequence[tuple[str, str]]
) -> bytes:
    """Return the message of a step as JSON.

    Args:
        nominal: Reference and deviation together, the rigid states first, SI.
        centre: Centre of the set of errors, the rigid states first; empty if the design has none.
        half_width: Half-width of the set, ordered like ``centre``.
        faults: Channel and type of those that are active.
    """
    nominal = np.asarray(nominal[:N_RIGID], float)
    parts = {"nominal": nominal}
    if len(half_width):
        middle, half = (np.asarray(values[:N_RIGID], float) for values in (centre, half_width))
        parts |= {"lower": nominal + middle - half, "upper": nominal + middle + half}
    message: dict[str, Any] = {
        # JSON has no number that is not finite.
        part: {name: value for name, value in zip(STATES, values.tolist(), strict=True) if np.isfinite(value)}
        for part, values in parts.items()
    }
    message[FAULTS] = "; ".join(f"{channel}: {kind}" for channel, kind in faults) or NO_FAULT
    return json.dumps(message, separators=(",", ":")).encode()

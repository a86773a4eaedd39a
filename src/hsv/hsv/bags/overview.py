"""Data for viewers from several topics: nominal state, bounds of the tube, active faults.

Viewers plot fields but do not add them. The nominal state is the sum of two fields, a bound of the tube of four.
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
"""Fields of each part, SI."""

PARTS = ("nominal", "lower", "upper")
"""Parts of the message; the bounds exist only for a flight with a tube."""

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
        nominal: Nominal state x_r + x_n, the rigid states first, SI.
        centre: Centre of the invariant set of errors, the rigid states first; empty if the design has none.
        half_width: Half-widths of the set, in the order of ``centre``.
        faults: Channel and type of each active fault.
    """
    nominal = np.asarray(nominal[:N_RIGID], float)
    parts = {"nominal": nominal}
    if len(half_width):
        middle, half = (np.asarray(values[:N_RIGID], float) for values in (centre, half_width))
        parts |= {"lower": nominal + middle - half, "upper": nominal + middle + half}
    message: dict[str, Any] = {
        # JSON has neither NaN nor infinities.
        part: {name: value for name, value in zip(STATES, values.tolist(), strict=True) if np.isfinite(value)}
        for part, values in parts.items()
    }
    message[FAULTS] = "; ".join(f"{channel}: {kind}" for channel, kind in faults) or NO_FAULT
    return json.dumps(message, separators=(",", ":")).encode()

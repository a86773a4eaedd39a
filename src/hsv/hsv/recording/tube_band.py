"""Where the tube lets the vehicle be: nominal trajectory and the edges of the tube about it, as a message of a viewer.

Viewers plot fields and do not add them up: reference, deviation, centre and half-width of the tube are four.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np

from hsv.vehicle.dynamics import N_RIGID, STATE_NAMES

TUBE_TOPIC = "/hsv/tube"
TUBE_TYPE = "hsv.Tube"

PARTS = ("nominal", "lower", "upper")
"""Each with the rigid states as fields; the edges only where there is a tube."""

_FIELDS = STATE_NAMES[:N_RIGID]

TUBE_SCHEMA = json.dumps(
    {
        "title": TUBE_TYPE,
        "type": "object",
        "properties": {
            part: {"type": "object", "properties": {name: {"type": "number"} for name in _FIELDS}} for part in PARTS
        },
    }
).encode()
"""JSON schema of the message."""


def tube_message(nominal: np.ndarray, centre: Sequence[float], half_width: Sequence[float]) -> bytes:
    """Return the message of a step as JSON, SI.

    Args:
        nominal: Reference and deviation together, the rigid states first, shape (5+,).
        centre: Of the set of errors, the rigid states first; empty where the design has none.
        half_width: Of it, as ``centre``.
    """
    nominal = np.asarray(nominal[:N_RIGID], float)
    parts = {"nominal": nominal}
    if len(half_width):
        middle, half = (np.asarray(values[:N_RIGID], float) for values in (centre, half_width))
        parts |= {"lower": nominal + middle - half, "upper": nominal + middle + half}
    # JSON has no number that is not finite.
    finite = {
        part: {n: v for n, v in zip(_FIELDS, x.tolist(), strict=True) if np.isfinite(v)} for part, x in parts.items()
    }
    return json.dumps(finite, separators=(",", ":")).encode()

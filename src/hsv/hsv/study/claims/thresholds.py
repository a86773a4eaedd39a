"""Thresholds that several claims share, and why they are what they are."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.claim import shown
from hsv.vehicle.envelope import FOOT

HALF_DEGREE = float(np.radians(0.5))
"""rad: the paper's largest allowable error of the attitude angles (5.1)."""

BAND = 0.02
"""Share of the step within which a response is accurate: the usual band of a settled one."""

ALTITUDE_STEP, VELOCITY_STEP = 600.0 * FOOT, 250.0 * FOOT
"""m, m/s: what Case 1 and Case 2 command."""

ALTITUDE_BAND, VELOCITY_BAND = BAND * ALTITUDE_STEP, BAND * VELOCITY_STEP
"""m, m/s."""

SOON = 20.0
"""s: a tenth of the flight that the paper's figures show."""

A_LOT = 1.5
"""Ratio from which on something is a lot more."""

SIGNIFICANT, SLIGHT = 0.5, 0.75
"""What is left of something: after a significant reduction at most, after a slight one at least."""

REASONS = f"""Thresholds of ours that return: *accurate*, within {100 * BAND:g} % of the step (the usual band of a
settled response: {shown(ALTITUDE_BAND, "m")}, {shown(VELOCITY_BAND, "m/s")}); *soon*, within {SOON:g} s (a tenth of
the flight that the paper's figures show); a comparative such as *smaller*, a ratio of at most 1; *a lot more*, by half
at least; a *significant* reduction, to half at most; a *slight* one, to three quarters at least; *stable*, no flight
lost, no growth of the loop.
"""

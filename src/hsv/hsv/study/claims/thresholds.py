"""Thresholds that several claims share, and why they are what they are."""

from __future__ import annotations

import numpy as np

from hsv.study.claims.finding import shown
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

EVER = float(np.finfo(float).max)
"""s: what has not settled by then has not settled by the end of the flight."""

A_LOT = 1.5
"""Ratio from which on something is a lot more."""

SIGNIFICANT, SLIGHT = 0.5, 0.75
"""Remaining fractions: at most, after a significant reduction; at least, after a slight one."""

CLEARLY = 0.95
"""Times what it was: a change of 5 % can be seen in a figure."""

RAISED = 3.0
"""dB: from here on a change of the response counts as one, of its power by a factor of two."""

GAIN_UNCHANGED, PHASE_UNCHANGED = 0.5, float(np.radians(5.0))
"""dB, rad: 6 % of a gain, 5 deg of phase: less is lost in the uncertainty of the vehicle."""

ONE_LINE_MAGNITUDE, ONE_LINE_PHASE = 1.0, 5.0
"""dB, deg: how far apart two lines of a Bode diagram of the paper's size may be and look like one."""

REASONS = f"""Thresholds of ours that return: *accurate*, within {100 * BAND:g} % of the step (the usual band of a
settled response: {shown(ALTITUDE_BAND, "m")}, {shown(VELOCITY_BAND, "m/s")}); *soon*, within {SOON:g} s (a tenth of
the flight that the paper's figures show); a comparative such as *smaller*, a ratio of at most 1; *a lot more*, by half
at least; a *significant* reduction, to half at most; a *slight* one, to three quarters at least; *stable*, no flight
lost, no growth of the loop.
"""

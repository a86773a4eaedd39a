"""Thresholds that several claims share, with the reasons for them."""

from __future__ import annotations

import numpy as np

from hsv.base.units import FOOT
from hsv_paper.claims.finding import shown

HALF_DEGREE = float(np.radians(0.5))
"""rad: the paper's largest allowable error of the attitude angles (5.1)."""

BAND = 0.02
"""Share of the step within which a response is accurate: the usual settling band."""

ALTITUDE_STEP, VELOCITY_STEP = 600.0 * FOOT, 250.0 * FOOT
"""m, m/s: the commands of Case 1 and Case 2."""

ALTITUDE_BAND, VELOCITY_BAND = BAND * ALTITUDE_STEP, BAND * VELOCITY_STEP
"""m, m/s."""

SOON = 20.0
"""s: a tenth of the flight that the paper's figures show."""

EVER = float(np.finfo(float).max)
"""s: a larger settling time means that the flight ended before the response had settled."""

A_LOT = 1.5
"""Smallest ratio that counts as a lot more."""

SIGNIFICANT, SLIGHT = 0.5, 0.75
"""Remaining fractions: at most, after a significant reduction; at least, after a slight reduction."""

CLEARLY = 0.95
"""Largest ratio that counts as a reduction: a change of 5 % can be seen in a figure."""

RAISED = 3.0
"""dB: smallest change of a response that counts as a change, a factor of two in power."""

GAIN_UNCHANGED, PHASE_UNCHANGED = 0.5, float(np.radians(5.0))
"""dB, rad: 6 % of the gain, 5 deg of phase; smaller changes are within the uncertainty of the vehicle."""

ONE_LINE_MAGNITUDE, ONE_LINE_PHASE = 1.0, 5.0
"""dB, deg: largest distance at which two lines of a Bode diagram of the paper's size look like one."""

REASONS = f"""Several claims share these thresholds of ours: *accurate* means within {100 * BAND:g} % of the step, the
usual settling band ({shown(ALTITUDE_BAND, "m")}, {shown(VELOCITY_BAND, "m/s")}); *soon*, within {SOON:g} s, a tenth of
the flight that the paper's figures show; a comparative such as *smaller*, a ratio of at most 1; *a lot more*, by at
least half; a *significant* reduction, to at most half; a *slight* reduction, to at least three quarters; *stable*, that
no flight is lost and that no pole of the linear loop has a positive real part.
"""

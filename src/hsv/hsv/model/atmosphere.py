"""Wind, shear, gusts, turbulence and variation of the density, see ``core/atmosphere.h``.

Wind and density are held over a control period. Turbulence follows Dryden's model (MIL-F-8785C, MIL-HDBK-1797).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsv.base.parameters import Parameter, check_lengths, validate
from hsv.base.units import FOOT
from hsv.core import Struct
from hsv.model.signals import first_step

_LENGTH = 1750.0 * FOOT
"""Scale length of the turbulence (m) above 2000 ft (MIL-F-8785C)."""

ATMOSPHERE_PARAMETERS = (
    Parameter("wind.forward", 0.0, "steady wind from behind", "m/s", -200.0, 200.0),
    Parameter("wind.up", 0.0, "steady wind from below", "m/s", -50.0, 50.0),
    Parameter("wind.shear", 0.0, "increase of the wind from behind with altitude", "1/s", -0.5, 0.5),
    Parameter("wind.shear_altitude", 26060.4, "altitude at which the shear adds no wind", "m", 0.0, 1e5),
    Parameter("turbulence.sigma_forward", 0.0, "standard deviation of the turbulence along the path", "m/s", 0.0, 50.0),
    Parameter("turbulence.sigma_up", 0.0, "standard deviation of the turbulence across the path", "m/s", 0.0, 50.0),
    Parameter("turbulence.length_forward", _LENGTH, "scale of the turbulence along the path", "m", 30.0, 1e5),
    Parameter("turbulence.length_up", _LENGTH, "scale of the turbulence across the path", "m", 30.0, 1e5),
    Parameter("gust.starts", [], "simulated time at which each gust begins", "s", 0.0, 1e5),
    Parameter("gust.forward", [], "largest velocity of each gust from behind", "m/s", -100.0, 100.0),
    Parameter("gust.up", [], "largest velocity of each gust from below", "m/s", -100.0, 100.0),
    Parameter("gust.lengths", [], "distance over which each gust builds up", "m", 1.0, 1e6),
    Parameter(
        "gust.stays",
        [],
        "1: the gust stays (MIL-F-8785C), 0: it decays as it rose (CS-25.341)",
        "",
        0.0,
        1.0,
        whole=True,
    ),
    Parameter("density.offset", 0.0, "relative difference of the density from the model's", "", -0.5, 1.0),
    Parameter("density.sigma", 0.0, "standard deviation of the variation along the path", "", 0.0, 0.5),
    Parameter("density.length", 1e5, "distance over which it varies", "m", 1e3, 1e8),
)

_MEMORY = 4
"""Numbers in the memory of the air before the distances flown into the gusts."""


def atmosphere_data(values: Mapping[str, object], period: float) -> Struct:
    """Return the atmosphere that values of :data:`ATMOSPHERE_PARAMETERS` describe, for a control ``period`` (s)."""
    v = validate(ATMOSPHERE_PARAMETERS, values)
    starts = v["gust.starts"]
    for name in ("gust.forward", "gust.up", "gust.stays"):
        v[name] = v[name] or [0.0] * len(starts)
    check_lengths(v, "gust.starts", "gust.forward", "gust.up", "gust.lengths", "gust.stays")
    wind = np.array([v["wind.forward"], v["wind.up"]])
    sigma = np.array([v["turbulence.sigma_forward"], v["turbulence.sigma_up"]])
    changed = (v["wind.shear"], v["density.offset"], v["density.sigma"])
    return Struct(
        "hsv_atmosphere",
        wind=wind,
        shear=v["wind.shear"],
        shear_altitude=v["wind.shear_altitude"],
        sigma=sigma,
        length=np.array([v["turbulence.length_forward"], v["turbulence.length_up"]]),
        gust_start=np.array([first_step(start, period) for start in starts], np.int64),
        gust=np.column_stack((v["gust.forward"], v["gust.up"])),
        gust_length=np.array(v["gust.lengths"], float),
        gust_stays=np.array(v["gust.stays"], float),
        density_offset=v["density.offset"],
        density_sigma=v["density.sigma"],
        density_length=v["density.length"],
        period=period,
        still=not (wind.any() or sigma.any() or len(starts) or any(changed)),
    )


def atmosphere_state(data: Struct) -> np.ndarray:
    """Return the state before step 0, shape (4 + gusts,): zeros; step 0 draws those of turbulence and density."""
    return np.zeros(_MEMORY + len(data.gust_start))

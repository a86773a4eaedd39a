"""Wind, shear, gusts, turbulence and density that differs from the model's, see ``core/atmosphere.h``.

The air is held over a control period. Turbulence is Dryden's (MIL-F-8785C, MIL-HDBK-1797).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hsv.base.errors import ParameterError
from hsv.base.parameters import Parameter, validate
from hsv.base.units import FOOT
from hsv.model.signals import first_step

_LENGTH = 1750.0 * FOOT
"""Scale of turbulence above 2000 ft (MIL-F-8785C)."""

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
"""Size of the memory of the air without the distance flown into each gust"""


class AtmosphereData(NamedTuple):
    """The atmosphere for the core, SI; gusts are rows (g), which begin in step ``gust_start``."""

    wind: np.ndarray
    shear: float
    shear_altitude: float
    sigma: np.ndarray
    length: np.ndarray
    gust_start: np.ndarray
    gust: np.ndarray
    gust_length: np.ndarray
    gust_stays: np.ndarray
    density_offset: float
    density_sigma: float
    density_length: float
    period: float
    still: bool
    """Whether the air is still and of the model's density; it is then not stepped"""


def atmosphere_data(values: Mapping[str, object], period: float) -> AtmosphereData:
    """Return the atmosphere that :data:`ATMOSPHERE_PARAMETERS` describe, stepped every ``period`` (s).

    Raises:
        ParameterError: A wrong value, or arrays of different lengths.
    """
    v = validate(ATMOSPHERE_PARAMETERS, values)
    starts = v["gust.starts"]
    columns = {}
    for name, standard in (("forward", 0.0), ("up", 0.0), ("lengths", 0.0), ("stays", 0.0)):
        given = v[f"gust.{name}"] or ([standard] * len(starts) if name != "lengths" else [])
        if len(given) != len(starts):
            raise ParameterError(
                f"parameter gust.{name}: {len(given)} values, expected as many as gust.starts, {len(starts)}"
            )
        columns[name] = np.array(given, np.float64)
    wind = np.array([v["wind.forward"], v["wind.up"]])
    sigma = np.array([v["turbulence.sigma_forward"], v["turbulence.sigma_up"]])
    changed = (v["wind.shear"], v["density.offset"], v["density.sigma"])
    return AtmosphereData(
        wind,
        v["wind.shear"],
        v["wind.shear_altitude"],
        sigma,
        np.array([v["turbulence.length_forward"], v["turbulence.length_up"]]),
        np.array([first_step(start, period) for start in starts], np.int64),
        np.column_stack((columns["forward"], columns["up"])),
        columns["lengths"],
        columns["stays"],
        v["density.offset"],
        v["density.sigma"],
        v["density.length"],
        period,
        not (wind.any() or sigma.any() or len(starts) or any(changed)),
    )


def atmosphere_state(data: AtmosphereData) -> np.ndarray:
    """Return the memory (4 + g) of the air, which the first step fills."""
    return np.zeros(_MEMORY + len(data.gust_start))

"""Air that moves and whose density is not that of the model: wind, shear, gusts, turbulence, compiled.

Once a period the block says what the air does over the next one: velocity forward and up (m/s) and density for that of
the model. It is held over the substeps. Turbulence is Dryden's (MIL-F-8785C, MIL-HDBK-1797): white noise through

    H_u(s) = sigma_u sqrt(2 tau_u) / (1 + tau_u s)
    H_w(s) = sigma_w sqrt(tau_w) (1 + sqrt(3) tau_w s) / (1 + tau_w s)^2

with tau = L / V and noise of unit density. Both filters are discretised exactly and stationary from the first step on,
for any period; the speed is that of the step.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from hsv.compiled import njit_in_flight
from hsv.elementary import exponential, sine
from hsv.errors import ParameterError
from hsv.noise import STREAMS, normals
from hsv.parameters import Parameter, check_all
from hsv.timing import first_step
from hsv.vehicle.envelope import FOOT

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

U, Z1, Z2, DENSITY, DISTANCE = range(5)
"""The state: turbulence along the path over its sigma, the two states of that across it, the density's variation over
its sigma; from the last one on, how far each gust was flown into (m)."""

_SQRT_3 = 1.7320508075688772
_PI = 3.141592653589793
_FORWARD, _UP, _DENSITY = (STREAMS[name] for name in ("turbulence_longitudinal", "turbulence_vertical", "density"))


class AtmosphereData(NamedTuple):
    """The atmosphere for compiled functions, SI; gusts are rows (g), which begin in step ``gust_start``."""

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
    """Nothing of it is on: no one need step it."""


def atmosphere_data(values: Mapping[str, object], period: float) -> AtmosphereData:
    """Return the atmosphere that :data:`ATMOSPHERE_PARAMETERS` describe, stepped every ``period`` (s).

    Raises:
        ParameterError: A wrong value, or arrays of different lengths.
    """
    v = check_all(ATMOSPHERE_PARAMETERS, values)
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
    """Return room for the state (5 + g - 1) of the atmosphere, which the first step fills."""
    return np.zeros(DISTANCE + len(data.gust_start))


@njit_in_flight(error_model="numpy")
def dryden_cross_map(r: float) -> tuple[float, float, float, float, float, float, float]:
    """Return F (2, 2) and the lower factor of I - F F' (three entries) of H_w over the distance ``r`` L.

    The states are standard normal and uncorrelated; w is half sigma times the first plus sqrt(3) times the second.
    """
    decay = exponential(-r)
    square = decay * decay
    first = np.sqrt(max(1.0 - square * (1.0 + 2.0 * r + 2.0 * r * r), 0.0))
    across = 2.0 * square * r * r
    lower = across / first if first > 0.0 else 0.0
    second = np.sqrt(max(1.0 - square * (1.0 - 2.0 * r + 2.0 * r * r) - lower * lower, 0.0))
    return decay * (1.0 + r), decay * r, -decay * r, decay * (1.0 - r), first, lower, second


@njit_in_flight(error_model="numpy")
def _gust_integral(x: float, length: float, stays: bool) -> float:
    """Return the integral from 0 to ``x`` (m) of (1 - cos(pi x / length)) / 2, which ends or stays where it says."""
    end = length if stays else 2.0 * length
    inside = min(max(x, 0.0), end)
    area = 0.5 * (inside - length / _PI * sine(_PI * (inside / length)))
    return area + (x - end) if stays and x > end else area


@njit_in_flight(error_model="numpy")
def gust_mean(begin: float, end: float, length: float, stays: bool) -> float:
    """Return the mean between two distances (m) flown into a gust, for its largest velocity, by its closed form."""
    return (_gust_integral(end, length, stays) - _gust_integral(begin, length, stays)) / (end - begin)


@njit_in_flight(error_model="numpy")
def atmosphere_step(
    data: Any, state: np.ndarray, step: int, seed: int, altitude: float, speed: float, air: np.ndarray
) -> None:
    """Write into ``air`` (3) wind forward and up (m/s) and the density factor of ``step``; advance ``state``.

    Args:
        data: :class:`AtmosphereData`.
        state: See :func:`atmosphere_state`; step 0 begins it.
        step: k.
        seed: Of the flight.
        altitude: m.
        speed: m/s, with which the vehicle flies through the air of a period.
        air: Written.
    """
    way = speed * data.period
    air[0] = data.wind[0] + data.shear * (altitude - data.shear_altitude)
    air[1] = data.wind[1]
    air[2] = 1.0 + data.density_offset
    if data.sigma[0] > 0.0:
        _advance_markov(state, U, way / data.length[0], step, seed, _FORWARD)
        air[0] += data.sigma[0] * state[U]
    if data.sigma[1] > 0.0:
        first, second = normals(seed, step, _UP)
        if step == 0:
            state[Z1], state[Z2] = first, second
        else:
            f_11, f_12, f_21, f_22, l_11, l_21, l_22 = dryden_cross_map(way / data.length[1])
            a, b = state[Z1], state[Z2]
            state[Z1] = f_11 * a + f_12 * b + l_11 * first
            state[Z2] = f_21 * a + f_22 * b + (l_21 * first + l_22 * second)
        air[1] += 0.5 * data.sigma[1] * (state[Z1] + _SQRT_3 * state[Z2])
    if data.density_sigma > 0.0:
        _advance_markov(state, DENSITY, way / data.density_length, step, seed, _DENSITY)
        air[2] += data.density_sigma * state[DENSITY]
    for i in range(len(data.gust_start)):
        if step >= data.gust_start[i]:
            begin = state[DISTANCE + i]
            mean = gust_mean(begin, begin + way, data.gust_length[i], data.gust_stays[i] != 0.0)
            air[0] += data.gust[i, 0] * mean
            air[1] += data.gust[i, 1] * mean
            state[DISTANCE + i] = begin + way


@njit_in_flight(error_model="numpy")
def _advance_markov(state: np.ndarray, place: int, r: float, step: int, seed: int, stream: int) -> None:
    """Advance a standard Gauss-Markov process by ``r`` of its scale; step 0 draws where it begins."""
    drawn, _ = normals(seed, step, stream)
    if step == 0:
        state[place] = drawn
    else:
        decay = exponential(-r)
        state[place] = decay * state[place] + np.sqrt(max(1.0 - decay * decay, 0.0)) * drawn


@njit_in_flight(error_model="numpy")
def speed_of_sound(altitude: float) -> float:
    """Return the speed of sound (m/s) of the US Standard Atmosphere 1976 at a geometric altitude of 11 to 32 km."""
    geopotential = 6356766.0 * altitude / (6356766.0 + altitude)
    temperature = 216.65 + 0.001 * max(geopotential - 20000.0, 0.0)
    return np.sqrt(1.4 * 287.05287 * temperature)

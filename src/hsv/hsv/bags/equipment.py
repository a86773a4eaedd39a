"""Deviations of sensors, links, effectors and air from the ideal in a bag."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsv.bags.columns import Columns
from hsv.bags.description import ACTUATOR, COMMAND, FORCES, MEASUREMENT, STATE
from hsv.bags.flight import input_columns, state_columns
from hsv.bags.reader import Bag
from hsv.model.signals import INPUT_NAMES, STATE_NAMES

CALM_AIR = {"wind_forward": 0.0, "wind_up": 0.0, "density_factor": 1.0}
"""Fields of the air and their values in calm air."""

_EFFECTOR = "effector."


def equipment_topics(bag: Bag) -> list[str]:
    """Return the topics in ``bag`` that the functions of this module read."""
    return [topic for topic in (STATE, MEASUREMENT, COMMAND, ACTUATOR, FORCES) if topic in bag.roles]


def measurement_errors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the measurement error (n), SI, of each state with an error; ``topics`` have equal steps row by row."""
    if MEASUREMENT not in topics:
        return {}
    errors = state_columns(topics[MEASUREMENT], "state.") - state_columns(topics[STATE])
    return {name: error for name, error in zip(STATE_NAMES, errors.T, strict=True) if error.any()}


def held(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return masks (n) of the steps in which a link held its old payload, for the links with such steps."""
    ends = {}
    if MEASUREMENT in topics:
        ends["measurement"] = state_columns(topics[STATE]), state_columns(topics[MEASUREMENT], "state.")
    if COMMAND in topics and ACTUATOR in topics:
        ends["command"] = input_columns(topics[COMMAND]), input_columns(topics[ACTUATOR])
    kept = {name: _repeats(taken) & ~_repeats(sent) for name, (sent, taken) in ends.items()}
    return {name: steps for name, steps in kept.items() if steps.any()}


def _repeats(rows: np.ndarray) -> np.ndarray:
    """Return the mask (n) of the ``rows`` (n, m) that equal the previous row."""
    return np.append(False, (rows[1:] == rows[:-1]).all(axis=1))[: len(rows)]


def effectors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the positions (n), SI, over the period of each step, the last NaN, of effectors that do not follow."""
    if ACTUATOR not in topics:
        return {}
    commanded = dict(zip(INPUT_NAMES, input_columns(topics[ACTUATOR]).T, strict=True))
    positions = {name: _over_the_period(topics, f"{_EFFECTOR}{name}") for name in INPUT_NAMES}
    return {name: y for name, y in positions.items() if len(y) and (np.isfinite(y) & (y != commanded[name])).any()}


def moving_air(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the fields of :data:`CALM_AIR` that differ from calm air, as values (n) over the period of each step."""
    air = {name: _over_the_period(topics, name) for name in CALM_AIR}
    return {name: y for name, y in air.items() if (np.isfinite(y) & (y != CALM_AIR[name])).any()}


def _over_the_period(topics: Mapping[str, Columns], field: str) -> np.ndarray:
    """Return a field of the forces (n) over the period that begins with each step; NaN if it is not recorded."""
    if FORCES not in topics or field not in topics[FORCES]:
        return np.empty(0)
    forces = topics[FORCES]
    # The message of a step contains the forces over the previous period, that of the first step those at trim.
    consecutive = np.diff(forces["step"].astype(np.int64)) == 1
    return np.append(np.where(consecutive, forces[field][1:], np.nan), np.nan)

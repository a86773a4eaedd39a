"""Sensors, links, effectors and air in a bag that are not ideal."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hsv.bags.columns import Columns
from hsv.bags.description import ACTUATOR, COMMAND, FORCES, MEASUREMENT, STATE
from hsv.bags.flight import input_columns, state_columns
from hsv.bags.reader import Bag
from hsv.model.signals import INPUT_NAMES, STATE_NAMES

CALM_AIR = {"wind_forward": 0.0, "wind_up": 0.0, "density_factor": 1.0}
"""Fields of the air, with their values in calm air."""

_EFFECTOR = "effector."


def equipment_topics(bag: Bag) -> list[str]:
    """Return the topics that the functions below read, of those that are in ``bag``."""
    return [topic for topic in (STATE, MEASUREMENT, COMMAND, ACTUATOR, FORCES) if topic in bag.roles]


def measurement_errors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return measurement less truth (n), SI, of the states where they differ in any step.

    Args:
        topics: Columns of the topics of :func:`equipment_topics`, rows of the same steps.
    """
    if MEASUREMENT not in topics:
        return {}
    errors = state_columns(topics[MEASUREMENT], "state.") - state_columns(topics[STATE])
    return {name: error for name, error in zip(STATE_NAMES, errors.T, strict=True) if error.any()}


def held(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the steps (n) in which a link held all of its old payload although a newer one was due.

    Of measurement and command, where there are any; arguments as of :func:`measurement_errors`.
    """
    ends = {}
    if MEASUREMENT in topics:
        ends["measurement"] = state_columns(topics[STATE]), state_columns(topics[MEASUREMENT], "state.")
    if COMMAND in topics and ACTUATOR in topics:
        ends["command"] = input_columns(topics[COMMAND]), input_columns(topics[ACTUATOR])
    kept = {name: _repeats(taken) & ~_repeats(sent) for name, (sent, taken) in ends.items()}
    return {name: steps for name, steps in kept.items() if steps.any()}


def _repeats(rows: np.ndarray) -> np.ndarray:
    """Return which of the ``rows`` (n, m) are those before."""
    return np.append(False, (rows[1:] == rows[:-1]).all(axis=1))[: len(rows)]


def effectors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the positions (n), SI, of effectors that differed from the command, over the period of a step.

    The last is not known, NaN; arguments as of :func:`measurement_errors`.
    """
    if ACTUATOR not in topics:
        return {}
    told = dict(zip(INPUT_NAMES, input_columns(topics[ACTUATOR]).T, strict=True))
    were = {name: _over_the_period(topics, f"{_EFFECTOR}{name}") for name in INPUT_NAMES}
    return {name: y for name, y in were.items() if len(y) and (np.isfinite(y) & (y != told[name])).any()}


def moving_air(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return the fields of :data:`CALM_AIR` (n) that differ from calm air, over the period of a step, as above."""
    air = {name: _over_the_period(topics, name) for name in CALM_AIR}
    return {name: y for name, y in air.items() if (np.isfinite(y) & (y != CALM_AIR[name])).any()}


def _over_the_period(topics: Mapping[str, Columns], field: str) -> np.ndarray:
    """Return a field of the forces (n) over the period that begins with a step, NaN where no message tells it."""
    if FORCES not in topics or field not in topics[FORCES]:
        return np.empty(0)
    forces = topics[FORCES]
    # A step tells of the period before it, and the first one of the trim.
    next_is_there = np.diff(forces["step"].astype(np.int64)) == 1
    return np.append(np.where(next_is_there, forces[field][1:], np.nan), np.nan)

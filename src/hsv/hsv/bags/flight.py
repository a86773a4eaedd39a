"""Flight data from a bag, for metrics and fingerprint, and what sensors, links, effectors and air added to signals."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from hsv.bags.columns import Columns
from hsv.bags.description import (
    ACTUATOR,
    COMMAND,
    FILTERED_STATE,
    FORCES,
    MEASUREMENT,
    NOMINAL,
    STATE,
    TUBE_STATUS,
)
from hsv.bags.reader import Bag
from hsv.bags.steps import cut_off, expected_stamps, joined
from hsv.flight.fingerprint import fingerprint
from hsv.flight.history import History
from hsv.flight.metrics import FlightData
from hsv.model.signals import INPUT_NAMES, STATE_NAMES

CALM_AIR = {"wind_forward": 0.0, "wind_up": 0.0, "density_factor": 1.0}
"""Fields of the air and their values in calm air."""

MEASURED = (STATE, NOMINAL, COMMAND, ACTUATOR)
"""Topics from which the metrics are computed."""


def labels(bags: Sequence[Bag]) -> list[str]:
    """Return a distinct label for each of ``bags``: its scenario; where bags share it, also folder, path or number."""
    scenarios = [bag.custom_data.get("scenario", bag.path.stem) for bag in bags]
    names = scenarios
    for details in (
        [bag.folder.absolute().name for bag in bags],
        [str(bag.path) for bag in bags],
        [f"{bag.path}, {number}" for number, bag in enumerate(bags, 1)],
    ):
        count = Counter(names)
        names = [
            name if count[name] == 1 else f"{scenario} ({detail})"
            for name, scenario, detail in zip(names, scenarios, details, strict=True)
        ]
    return names


def state_columns(columns: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """Return the states x, shape (n, 9), SI, from the columns of n messages with the fields of LongitudinalState."""
    return np.column_stack([columns[f"{prefix}{name}"] for name in STATE_NAMES])


def input_columns(columns: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """Return the inputs u, shape (n, 2), of n messages with an InputVector: fuel equivalence ratio, elevator (rad)."""
    return np.column_stack((columns[f"{prefix}fuel_equivalence_ratio"], columns[f"{prefix}elevator_deflection"]))


def flight_data(bag: Bag) -> FlightData:
    """Return the flight in ``bag`` at the common steps of state, nominal and command, or raise a RecordingError."""
    rows = joined(bag, (STATE, NOMINAL, COMMAND))
    state, nominal, command = rows[STATE], rows[NOMINAL], rows[COMMAND]
    status = bag.columns(ACTUATOR)
    acting = np.flatnonzero([len(faults) > 0 for faults in status["active"]])
    u = input_columns(command)
    return FlightData(
        time=state["header.stamp"] * 1e-9,
        history=History.of(
            state=state_columns(state),
            deviation=state_columns(nominal, "deviation."),
            gain_index=nominal["gain_index"],
            u_unsaturated=np.where(command["saturated"], np.nan, u),
            command=u,
        ),
        reference=state_columns(nominal, "reference."),
        fault_start=float(status["header.stamp"][acting[0]]) * 1e-9 if len(acting) else None,
    )


def published_levels(bag: Bag) -> np.ndarray | None:
    """Return the tube level at the steps of :func:`flight_data`, as the controller published it; None without one."""
    if TUBE_STATUS not in bag.roles:
        return None
    return np.asarray(joined(bag, (STATE, NOMINAL, COMMAND, TUBE_STATUS))[TUBE_STATUS]["level"])


def flight_fingerprint(bag: Bag) -> str | None:
    """Return the flight's fingerprint, or None if steps may be missing, are repeated, or are out of order.

    Raise a RecordingError if no step is complete.
    """
    topics = (STATE, FILTERED_STATE, NOMINAL, COMMAND, ACTUATOR)
    state, filtered, nominal, command, actuator = joined(bag, topics).values()
    every = np.arange(len(state["step"]))
    if cut_off(bag) or len(every) < len(expected_stamps(bag)):
        return None
    if not all(np.array_equal(bag.columns(topic)["step"], every) for topic in topics):
        return None
    columns = (
        state_columns(state),
        filtered["filtered_pitch_rate"],
        state_columns(nominal, "deviation."),
        input_columns(nominal, "input."),
        input_columns(command),
        input_columns(actuator),
    )
    return fingerprint(np.column_stack(columns))


def equipment_topics(bag: Bag) -> list[str]:
    """Return the topics in ``bag``, by role, that show how sensors, links, effectors and air deviate from the ideal."""
    return [topic for topic in (STATE, MEASUREMENT, COMMAND, ACTUATOR, FORCES) if topic in bag.roles]


def measurement_errors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return {state: measurement error, SI, shape (n,)} of states with errors; all ``topics`` have the same n steps."""
    if MEASUREMENT not in topics:
        return {}
    errors = state_columns(topics[MEASUREMENT], "state.") - state_columns(topics[STATE])
    return {name: error for name, error in zip(STATE_NAMES, errors.T, strict=True) if error.any()}


def held(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return {link: mask, shape (n,)} of the steps, if any, where a link's output repeats and its input does not.

    The links are ``measurement`` (state to measurement) and ``command`` (command to actuator command).
    """
    ends = {}
    if MEASUREMENT in topics:
        ends["measurement"] = state_columns(topics[STATE]), state_columns(topics[MEASUREMENT], "state.")
    if COMMAND in topics and ACTUATOR in topics:
        ends["command"] = input_columns(topics[COMMAND]), input_columns(topics[ACTUATOR])
    kept = {name: _repeats(taken) & ~_repeats(sent) for name, (sent, taken) in ends.items()}
    return {name: steps for name, steps in kept.items() if steps.any()}


def _repeats(rows: np.ndarray) -> np.ndarray:
    """Return which ``rows``, shape (n, m), equal the previous row: a mask, shape (n,)."""
    return np.append(False, (rows[1:] == rows[:-1]).all(axis=1))[: len(rows)]


def effectors(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return, by name, the positions (SI, shape (n,)) of the effectors that ever deviate from the actuator command.

    Element k belongs to the period that begins with step k; it is NaN if not recorded, and for the last step.
    """
    if ACTUATOR not in topics:
        return {}
    commanded = dict(zip(INPUT_NAMES, input_columns(topics[ACTUATOR]).T, strict=True))
    positions = {name: _over_the_period(topics, f"effector.{name}") for name in INPUT_NAMES}
    return {name: y for name, y in positions.items() if len(y) and (np.isfinite(y) & (y != commanded[name])).any()}


def moving_air(topics: Mapping[str, Columns]) -> dict[str, np.ndarray]:
    """Return, by name, the air's fields that ever differ from :data:`CALM_AIR`, by period as in :func:`effectors`."""
    air = {name: _over_the_period(topics, name) for name in CALM_AIR}
    return {name: y for name, y in air.items() if (np.isfinite(y) & (y != CALM_AIR[name])).any()}


def _over_the_period(topics: Mapping[str, Columns], field: str) -> np.ndarray:
    """Return a field of /hsv/forces by period, shape (n,), as in :func:`effectors`; empty if ``topics`` lack it."""
    if FORCES not in topics or field not in topics[FORCES]:
        return np.empty(0)
    forces = topics[FORCES]
    # The message of a step contains the forces over the previous period, that of the first step those at trim.
    consecutive = np.diff(forces["step"].astype(np.int64)) == 1
    return np.append(np.where(consecutive, forces[field][1:], np.nan), np.nan)

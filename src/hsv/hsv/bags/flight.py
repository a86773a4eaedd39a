"""Data for metrics and fingerprint of a flight from a bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from hsv.bags.description import ACTUATOR, COMMAND, FILTERED_STATE, NOMINAL, STATE
from hsv.bags.reader import Bag
from hsv.bags.steps import cut_off, expected_stamps, joined
from hsv.flight.fingerprint import fingerprint
from hsv.flight.metrics import FlightData
from hsv.model.signals import STATE_NAMES

MEASURED = (STATE, NOMINAL, COMMAND, ACTUATOR)
"""Topics from which the metrics are computed."""


def labels(bags: Sequence[Bag]) -> list[str]:
    """Return a distinct label for each of ``bags``: its scenario, with as much of its path as necessary."""
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
    """Return x (n, 9) from the columns of a message with the fields of LongitudinalState."""
    return np.column_stack([columns[f"{prefix}{name}"] for name in STATE_NAMES])


def input_columns(columns: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """Return u (n, 2) from the columns of a message with the fields of InputVector."""
    return np.column_stack((columns[f"{prefix}fuel_equivalence_ratio"], columns[f"{prefix}elevator_deflection"]))


def flight_data(bag: Bag) -> FlightData:
    """Return the flight in ``bag`` for the steps contained in every topic; raise a RecordingError without any."""
    rows = joined(bag, (STATE, NOMINAL, COMMAND))
    state, nominal, command = rows[STATE], rows[NOMINAL], rows[COMMAND]
    status = bag.columns(ACTUATOR)
    acting = np.flatnonzero([len(faults) > 0 for faults in status["active"]])
    u = input_columns(command)
    return FlightData(
        time=state["header.stamp"] * 1e-9,
        state=state_columns(state),
        reference=state_columns(nominal, "reference."),
        deviation=state_columns(nominal, "deviation."),
        command=u,
        unlimited=np.where(command["saturated"], np.nan, u),
        gain_index=nominal["gain_index"],
        fault_start=float(status["header.stamp"][acting[0]]) * 1e-9 if len(acting) else None,
    )


def flight_fingerprint(bag: Bag) -> str | None:
    """Return the fingerprint of the flight in ``bag``, or ``None`` if steps are missing."""
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

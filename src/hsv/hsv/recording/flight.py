"""From a bag to what the metrics are made of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from hsv.errors import RecordingError
from hsv.recording.reader import Bag
from hsv.simulation.metrics import FlightData

_RIGID = ("altitude", "velocity", "angle_of_attack", "pitch_angle", "pitch_rate")


def labels(bags: Sequence[Bag]) -> list[str]:
    """Return a name for each of ``bags``: its scenario, with the bag's folder where several flew the same."""
    scenarios = [bag.custom_data.get("scenario", bag.path.stem) for bag in bags]
    count = Counter(scenarios)
    return [
        name if count[name] == 1 else f"{name} ({bag.path.parent.name})"
        for name, bag in zip(scenarios, bags, strict=True)
    ]


def state_columns(columns: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """Return x (n, 9) from the columns of a message with the fields of LongitudinalState."""
    coordinate, rate = columns[f"{prefix}elastic_coordinate"], columns[f"{prefix}elastic_rate"]
    rigid = [columns[f"{prefix}{name}"] for name in _RIGID]
    return np.column_stack((*rigid, coordinate[:, 0], rate[:, 0], coordinate[:, 1], rate[:, 1]))


def input_columns(columns: dict[str, np.ndarray], prefix: str = "") -> np.ndarray:
    """Return u (n, 2) from the columns of a message with the fields of InputVector."""
    return np.column_stack((columns[f"{prefix}fuel_equivalence_ratio"], columns[f"{prefix}elevator_deflection"]))


def flight_data(bag: Bag) -> FlightData:
    """Return the flight in ``bag``; of a broken-off run, the steps that are complete.

    Raises:
        RecordingError: A topic is missing, or no step is complete.
    """
    state, nominal = bag.columns("/hsv/state"), bag.columns("/hsv/nominal")
    command, tube = bag.columns("/hsv/command"), bag.columns("/hsv/tube_status")
    steps = min(len(columns["step"]) for columns in (state, nominal, command, tube))
    if steps == 0:
        raise RecordingError(f"{bag.path}: holds no complete step, expected a flight")
    status = bag.columns("/hsv/fault_status")
    acting = np.flatnonzero([len(faults) > 0 for faults in status["active"]])
    return FlightData(
        time=state["header.stamp"][:steps] * 1e-9,
        state=state_columns(state)[:steps],
        reference=state_columns(nominal, "reference.")[:steps],
        deviation=state_columns(nominal, "deviation.")[:steps],
        command=input_columns(command)[:steps],
        saturated=tube["saturated"][:steps],
        gain_index=nominal["gain_index"][:steps],
        fault_start=float(bag.times("/hsv/fault_status")[acting[0]]) * 1e-9 if len(acting) else None,
    )

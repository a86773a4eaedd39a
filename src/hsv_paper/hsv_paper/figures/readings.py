"""Numbers for the remarks on the figures, measured on the flights that are drawn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hsv.base.units import to_paper
from hsv.flight.metrics import FlightData, flight_metrics
from hsv.model.vehicle import load_vehicle
from hsv_paper.figures.figure import Material
from hsv_paper.mode_peaks import PeakFall

_LIMITS = load_vehicle().decoupled

LIMITS = (
    f"{_LIMITS.input_minimum[0]:g} to {_LIMITS.input_maximum[0]:g} and {np.degrees(_LIMITS.input_minimum[1]):g} deg to "
    f"{np.degrees(_LIMITS.input_maximum[1]):g} deg"
)
"""Limits of both inputs."""


def measured(material: Material, scenario: str, metric: str, unit: str) -> float:
    """Return a metric of a flight in the paper's unit."""
    return to_paper(flight_metrics(material.flights[scenario])[metric], unit)[0]


def input_extremes(material: Material, scenarios: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest commands (2) of several flights: fuel ratio, elevator in deg."""
    commands = np.concatenate([material.flights[scenario].command for scenario in scenarios])
    commands[:, 1] = np.degrees(commands[:, 1])
    return commands.min(axis=0), commands.max(axis=0)


def input_ranges(material: Material, scenarios: Sequence[str]) -> str:
    """Return the ranges of both commands over several flights, in words."""
    least, largest = input_extremes(material, scenarios)
    return f"{least[0]:.2f} to {largest[0]:.2f} and {least[1]:.1f} deg to {largest[1]:.1f} deg"


def limited(material: Material, scenarios: Sequence[str]) -> str:
    """Return in how many steps of several flights a command was saturated, in words."""
    steps = sum(int(np.any(material.flights[scenario].saturated, axis=1).sum()) for scenario in scenarios)
    return f"saturated in {steps or 'no'} step{'s' if steps > 1 else ''} of the {len(scenarios)} flights"


def peak_in_words(fall: PeakFall) -> str:
    """Return in words how far a filter lowers the peak of a mode."""
    start = f"falls from {fall.before.magnitude:.1f} dB at {fall.before.frequency:.2f} rad/s"
    if fall.after is None:
        return f"{start} so far that no peak remains"
    end = f"to {fall.after.magnitude:.1f} dB at {fall.after.frequency:.2f} rad/s"
    return f"{start} {end}, by {fall.decibel:.1f} dB peak to peak"


def gain_switches(flight: FlightData) -> np.ndarray:
    """Return the steps (s) in which the nominal law takes another gain of its nested family than in the step before."""
    return np.flatnonzero(np.diff(flight.gain_index)) + 1


def in_words(values: Sequence[float] | np.ndarray, pattern: str = ".0f") -> str:
    """Return numbers as a list in words: 1, 2 and 3."""
    texts = [format(value, pattern) for value in values]
    return f"{', '.join(texts[:-1])} and {texts[-1]}" if len(texts) > 1 else "".join(texts)

"""The lumped disturbance that acted in flights of a scenario, measured as the design measures its set W."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hsv.control.design import ControlDesign
from hsv.control.notch_filter import flown_sections
from hsv.design.disturbance import CHANNELS
from hsv.design.region import record
from hsv.design.tube_problem import channel_model
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.corners import Corner
from hsv.flight.flight import Flight
from hsv.flight.scenario import load_scenario
from hsv.flight.side_by_side import fly_perturbed
from hsv.model.vehicle import Vehicle


def largest_disturbances(scenario: str, over: Sequence[Corner]) -> dict[str, np.ndarray]:
    """Return by channel of W the largest magnitude (flights) over each flight of ``scenario``, SI.

    Args:
        scenario: A shipped one under the tube law, with or without notch filter.
        over: Relative changes of the vehicle's parameters, one flight each.
    """
    values = flight_parameters(load_scenario(scenario))
    sections = flown_sections(values) if values["notch.enabled"] else ()
    design = replace(ControlDesign.from_parameters(values), notch=sections)
    model = channel_model(design, Vehicle.from_parameters(values))
    parts = assemble(values)

    def largest(corner: Corner, flight: Flight) -> np.ndarray:
        return np.asarray(np.abs(model.signals(record(flight)).channels).max(axis=0))

    rows = np.array(fly_perturbed(parts, over, largest))
    return {channel.name: column for channel, column in zip(CHANNELS, rows.T, strict=True)}

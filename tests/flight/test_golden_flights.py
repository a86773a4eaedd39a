"""300 random flights of commit b8ecf8c, which numba compiled: the same bits alone, step by step and in lanes.

They cover every type and occurrence of faults, sensors, actuators, links, air, estimator, active law, notch filters,
designs and references; see tests/golden/README.md.
"""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from marking import long

from hsv.core import lanes
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.blocks import steps
from hsv.flight.closed_loop import fly
from hsv.flight.fingerprint import fingerprint
from hsv.flight.scenario import parse_scenario
from hsv.flight.side_by_side import FlightGroup
from hsv.model.vehicle import vehicle_tables

GOLDEN = Path(__file__).parents[1] / "golden"
VEHICLE = json.dumps(vehicle_tables(str(GOLDEN / "stiffened.toml")))
FILLED = (GOLDEN / "scenarios.jsonl").read_text().replace('"{vehicle}"', VEHICLE).replace("{folder}", str(GOLDEN))
# The library has designed `tight` anew since.
FILLED = FILLED.replace('"design": "tight"', f'"design": "{GOLDEN / "tight.yaml"}"')
LINES = FILLED.splitlines()
PARTS = 20


def golden(index):
    """Return the components and the expected digests of a golden flight."""
    line = json.loads(LINES[index])
    parsed = parse_scenario(tomli_w.dumps(line["scenario"]), line["name"])
    return assemble({**flight_parameters(parsed), **line.get("parameters", {})}), line["expected"]


def digest(array):
    return hashlib.sha256(np.ascontiguousarray(array, "<f8").tobytes()).hexdigest()


def check(flight, expected):
    history = flight.history
    digests = digest(history.auxiliary), digest(history.estimate)
    found = flight.fingerprint, len(history.signals), flight.status.name, *digests
    assert found == tuple(expected[name] for name in ("fingerprint", "rows", "status", "beside", "estimate"))


def stepwise(parts):
    """Return the fingerprint of the flight, computed with the blocks one step at a time."""
    rows = []
    for s in steps(parts):
        mine = s.state, s.filtered_pitch_rate, s.deviation, s.nominal_input, s.command, s.actuator
        rows.append(np.concatenate([np.ravel(each) for each in mine]))
    return fingerprint(np.array(rows))


def variants(parts):
    """Return ``parts`` and variants with other vehicles and seeds, one for each lane of the core."""
    group = [parts]
    for i in range(1, lanes()):
        seed = parts.plant.data.seed + 7 * i
        plant = parts.plant.varied(parts.plant.vehicle.perturbed({"mass": 0.01 * i, "lift_alpha": -0.02 * i}), seed)
        group.append(replace(parts, plant=plant, fault_injector=parts.fault_injector.with_seed(seed)))
    return group[::-1]


def compare_three_ways(indices):
    for index in indices:
        parts, expected = golden(index)
        check(fly(parts), expected)
        assert stepwise(parts) == expected["fingerprint"], index
        if lanes() > 1:
            group = variants(parts)
            assert FlightGroup.takes(group)
            *others, same = (flight for flight, _ in FlightGroup().fly(group))
            check(same, expected)
            assert [each.fingerprint for each in others] == [fly(each).fingerprint for each in group[:-1]], index


@pytest.mark.parametrize("part", [part if part % 3 == 0 else long(part) for part in range(PARTS)])
def test_golden_flights_have_the_bits_that_they_had(part):
    for index in range(part, len(LINES), PARTS):
        parts, expected = golden(index)
        check(fly(parts), expected)


def test_some_have_them_step_by_step_and_in_lanes():
    compare_three_ways(range(0, len(LINES), 40))


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
def test_all_have_them_step_by_step_and_in_lanes(part):
    compare_three_ways(range(part, len(LINES), PARTS))

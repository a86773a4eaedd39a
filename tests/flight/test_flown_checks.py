"""Repeated flights and random sequences agree with the certificate."""

import copy
from pathlib import Path

import numpy as np
import pytest

from hsv.certificate.checks import Subject, load_subject
from hsv.certificate.verification import Tube
from hsv.control.design_file import find_design
from hsv.flight.corners import drawn_flights
from hsv.flight.flown_checks import (
    bounding_corners,
    flight_checks,
    scenario_checks,
    verify,
)
from hsv.flight.random_sequences import random_sequences
from hsv.flight.scenario import load_scenario, parse_scenario, scenario_text

DESIGNS = sorted(path.stem for path in Path(__file__).parents[2].glob("offline_design/*.toml"))


@pytest.fixture(scope="module")
def baseline():
    return load_subject(find_design("baseline"))


@pytest.mark.long
@pytest.mark.parametrize("name", DESIGNS)
def test_a_shipped_design_passes_with_its_flights_and_sequences(name):
    checks = verify(load_subject(find_design(name)), seed=2)
    failed = [check.name for made in checks.values() for check in made if not check.ok]
    assert failed == (["share of W"] if name == "baseline_derived" else [])


def test_drawn_flights_lie_in_the_region_and_the_seed_decides(baseline):
    inputs, vehicle = baseline.certificate["inputs"], baseline.vehicle
    drawn = drawn_flights(inputs, vehicle, 1.0, 400, 3)
    assert drawn == drawn_flights(inputs, vehicle, 1.0, 400, 3) != drawn_flights(inputs, vehicle, 1.0, 400, 4)
    first, last = inputs["disturbance"]["fault_window"]
    assert all(first <= 0.02 * flight.start <= last and 0.9 <= flight.effectiveness <= 1.0 for flight in drawn)
    shares = np.array(
        [[flight.corner[name] / bound for name, bound in vehicle.uncertainty.items()] for flight in drawn]
    )
    corners = np.all(np.abs(np.abs(shares) - 1.0) < 1e-12, axis=1)
    assert np.abs(shares).max() <= 1.0 + 1e-12 and 100 < corners.sum() < 300
    assert 100 < sum(abs(flight.effectiveness - 0.9) < 1e-12 for flight in drawn) < 300


FALSIFIED = {
    ("disturbance", "measured", "lower", 0): (-0.39, "tube.disturbance.measured.lower[0]"),
    ("disturbance", "measured", "upper_flight", 2): (17, "tube.disturbance.measured.upper_flight"),
    ("flights", "flights"): (128, "tube.flights.flights"),
    ("flights", "worst_level"): (0.2, "tube.flights.worst_level"),
    ("tightening", "plan", "highest", 1): (0.2, "tube.tightening.plan.highest[1]"),
    ("flights", "outside"): (1, "tube.flights.outside"),
}
"""For each statement of the certificate: a false value, and the name of the check that fails."""


@pytest.mark.long
def test_falsified_statements_about_flights_are_noticed():
    subject = load_subject(find_design("winged_cone"))
    certificate = copy.deepcopy(subject.certificate)
    for (*path, last), (value, _) in FALSIFIED.items():
        table = certificate["tube"]
        for key in path:
            table = table[key]
        table[last] = value
    falsified = Subject(subject.design, certificate)
    failed = {check.name for check in flight_checks(falsified, seed=1, number=8) if not check.ok}
    assert failed >= {named for _, named in FALSIFIED.values()}


def test_no_sequence_leaves_the_set_and_the_seed_decides(baseline):
    tube = Tube(baseline, baseline.design, "tube")
    of_tube = tube.A, tube.columns, tube.c
    first = random_sequences(*of_tube, tube.Q, 4000, 600, 5)
    assert 0.9 < first["worst_level"] <= 1.0
    assert first == random_sequences(*of_tube, tube.Q, 4000, 600, 5) != random_sequences(*of_tube, tube.Q, 4000, 600, 6)
    assert random_sequences(*of_tube, 0.5 * tube.Q, 4000, 600, 5)["worst_level"] > 1.0


def test_a_flight_of_the_declared_region_keeps_to_the_certificate(baseline):
    checks = list(scenario_checks(baseline, load_scenario("case1"), bounding_corners(baseline)))
    assert [check.ok for check in checks] == [True] * 3
    assert 0.0 < checks[0].value <= baseline.certificate["tube"]["flights"]["worst_level"] * (1 + 1e-6)


def test_a_fault_beyond_the_region_is_found_outside(baseline):
    scenario = parse_scenario(scenario_text("case1").replace("effectiveness = 0.9", "effectiveness = 0.7"), "worse")
    _, disturbance, room = scenario_checks(baseline, scenario)
    assert not disturbance.ok and disturbance.value > 2.0 and "lost_elevator" in disturbance.name
    assert room.ok

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from hsv.base.errors import DesignError
from hsv.certificate.checks import load_subject
from hsv.certificate.coverage import uncovered_rates
from hsv.control.design_file import find_design, read_design
from hsv.control.hardware import uncovered_hardware
from hsv.control.tube_law import TubeStatusCode
from hsv.flight.assembly import assemble, assemble_flight, flight_parameters, uncovered_of
from hsv.flight.blocks import steps
from hsv.flight.scenario import load_scenario
from hsv.model.signals import INPUT_NAMES

BASELINE, REALISTIC = (read_design(find_design(name)) for name in ("baseline", "realistic"))
ELEVATOR = "elevator_deflection"


def of(changes, design=BASELINE, scenario="case1"):
    return uncovered_of(load_scenario(scenario, changes), design)


def test_a_design_that_is_not_as_it_was_written_is_not_covered(tmp_path):
    text = find_design("baseline").read_text()
    path = tmp_path / "baseline.yaml"
    path.write_text(text.replace("hash: ", "hash: 0", 1))
    [named] = of({}, read_design(path))
    assert named == "design: not as it was written, its parameters do not have the digest design.hash"


@pytest.mark.parametrize("inputs", [{}, None, {"disturbance": 0.9}, {"disturbance": {"elevator_effectiveness": "0.9"}}])
def test_a_certificate_that_does_not_say_what_it_covers_is_refused(inputs):
    with pytest.raises(DesignError, match=r"^certificate: .*: expected the region that it covers$"):
        uncovered_of(load_scenario("case1"), BASELINE, {"inputs": inputs})


BIAS = {"channel": ELEVATOR, "type": "bias", "start": "1 s", "offset": "-0.5 deg"}
LOSS = {"channel": ELEVATOR, "type": "loss_of_effectiveness", "start": "100 s", "effectiveness": 0.9}
SLOWER = {"actuator.elevator_deflection": {"set": "elevator_150", "natural_frequency": "90 rad/s"}}
SLOWER_WORDS = ("set: elevator_150", "natural_frequency: 90 rad/s")


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({}, []),
        ({"sensors.pitch_rate.noise": "0.01 deg/s"}, ["sensors.pitch_rate.noise: 0.01 deg/s; "]),
        (
            {"fault": [LOSS | {"intermittent_period": "20 s"}]},
            ["fault: comes and goes; the certificate is for one that"],
        ),
        ({"fault": [LOSS | {"random_on": "2 s", "random_off": "1 s"}]}, ["fault: comes and goes; "]),
        ({"sensors.altitude.random_walk": "1 ft/s^0.5"}, ["sensors.altitude.random_walk: 1 ft/s^0.5; "]),
        ({"wind.up": "3 ft/s"}, ["wind.up: 3 ft/s; the certificate is for still air"]),
        ({"density.offset": "-2 %"}, ["density.offset: -0.02; the certificate is for the model's density"]),
        ({"link.command.loss": "2 %", "link.command.burst": 3}, ["link.command.loss: 0.02; the certificate is for an"]),
        ({"link.computational_delay": "7 ms"}, ["link.computational_delay: 0.007 s; "]),
        ({"estimator.enabled": True}, ["estimator.enabled: "]),
        ({"vehicle.coupling": "derived"}, ["vehicle.coupling: derived; the certificate is for paper_like"]),
        ({"vehicle.perturbation.mass": "12 %"}, ["vehicle.perturbation.mass: 12 %; the certificate is for 10 % at"]),
        ({"vehicle.perturbation.mass": "10 %"}, []),
        ({"notch.enabled": False}, ["notch: none"]),
        ({"fault[0].effectiveness": 0.8}, ["fault: loss_of_effectiveness of elevator_deflection (effectiveness 0.8)"]),
        ({"fault[0].effectiveness": 0.95}, []),
        ({"fault[0].start": "61 s"}, []),
        ({"fault[0].start": "31 s"}, ["fault: at 31 s; the certificate is for 60 s to 195 s"]),
        ({"fault[0].stop": "120 s"}, ["fault: ends at 120 s; the certificate is for one that stays"]),
        (
            {"fault": [LOSS, LOSS | {"start": "150 s"}]},
            ["fault: 2 losses of elevator effectiveness; the certificate is"],
        ),
        ({"duration": "240 s"}, ["duration: 240 s; the certificate is for 200 s at most"]),
        (
            {"initial.altitude": "85200 ft"},
            ["initial.altitude: 25969; the certificate is for 26060.4", "reference.altitudes"],
        ),
        ({"command[0].altitude_change": "700 ft"}, ["reference.altitudes: 26273.8; the certificate is for 26243.3"]),
        ({"reference.trim": "static"}, ["reference.trim: static; the certificate is for climbing"]),
        ({"fault": [BIAS]}, ["fault: bias of elevator_deflection (offset -0.5 deg); the certificate is for a loss of"]),
        ({"actuator.elevator_deflection.stop": "29 deg"}, []),
        ({"actuator.elevator_deflection.stop": "28 deg"}, ["actuator.elevator_deflection.stop: 28 deg; "]),
        (SLOWER, [f"actuator.{ELEVATOR}.{own}; the certificate is for an ideal one" for own in SLOWER_WORDS]),
        ({"sensors.set": "fine"}, ["sensors.set: fine; the certificate is for an ideal one"]),
        ({"sensors.altitude": {"noise": "0 ft", "drift_time": "3 s", "drift_sigma": "0 ft"}}, []),
        ({"sensors.altitude.minimum": "0 ft"}, ["sensors.altitude.minimum: 0 ft; the certificate is for an ideal one"]),
    ],
)
def test_what_is_not_covered_is_named(changes, named):
    found = of(changes)
    assert len(found) == len(named), found
    for text, beginning in zip(found, named, strict=True):
        assert text.startswith(beginning)


def test_a_design_for_a_share_of_the_disturbances_says_so():
    design = read_design(find_design("baseline_derived"))
    assert of({}, design, "case1_derived") == [
        "disturbances: certified for 0.8 W; 1025 of 1025 measured flights leave it"
    ]


def test_a_design_covers_the_actuators_that_it_knows_and_no_others():
    known = {"actuator.elevator_deflection.set": "elevator_50", "actuator.fuel_equivalence_ratio.set": "fuel_10"}
    assert of(known | {"actuator.elevator_deflection.stop": "30 deg"}, REALISTIC) == []
    assert [text.partition(":")[0] for text in of(known, REALISTIC)] == ["actuator.elevator_deflection.stop"]
    assert [text.partition(";")[0] for text in of({}, REALISTIC)] == [
        f"actuator.{name}.set: ideal" for name in INPUT_NAMES
    ]


def test_rates_of_a_flight_are_compared_with_those_of_the_design():
    """The altitude of step k is that of k periods at 120 ft/s, the velocity that of 30 ft/s^2, exactly its limit."""
    period, foot = BASELINE.period, 0.3048
    states = np.zeros((5, 9))
    states[:, :2] = np.arange(5.0)[:, None] * period * np.array([120.0, 30.0]) * foot
    for limits, named in (
        ((130.0, 30.0), []),
        ((100.0, 30.0), ["altitude: 120 ft/s"]),
        ((130.0, 29.0), ["velocity: 30"]),
    ):
        design = replace(BASELINE, tube=replace(BASELINE.tube, rates=np.array(limits) * foot))
        found = uncovered_rates(design, states)
        assert [text.startswith(f"rate of {name}") for text, name in zip(found, named, strict=True)] == [True] * len(
            named
        )
    assert uncovered_rates(BASELINE, states) == []


def test_the_status_tells_of_rates():
    """The first step with a change that is not zero is faster than no rate at all."""
    slow = replace(BASELINE, tube=replace(BASELINE.tube, rates=np.full(2, 1e-9)))
    flown = [step.diagnostics.status for step in islice(steps(assemble_flight(load_scenario("case1"), slow)), 3)]
    assert flown[0] is TubeStatusCode.OK and flown[2] is TubeStatusCode.UNCERTIFIED_RATE


def test_the_status_tells_of_disturbances_outside_w():
    """The declared loss of effectiveness is in W, a larger one is not."""
    step = load_subject(find_design("baseline")).stated("tube.disturbance.step")
    watched = {"tube.disturbance": [*step["lower"], *step["upper"]]}
    for effectiveness, status in ((0.9, TubeStatusCode.OK), (0.7, TubeStatusCode.UNCERTIFIED_DISTURBANCE)):
        lost = {"channel": "elevator_deflection", "type": "loss_of_effectiveness", "effectiveness": effectiveness}
        values = flight_parameters(load_scenario("case1", {"fault": [lost | {"start": "2 s"}]}))
        flown = [step.diagnostics.status for step in islice(steps(assemble(values | watched)), 120)]
        assert flown[:101] == [TubeStatusCode.OK] * 101 and flown[101] is status


def test_where_no_tube_is_certified_nothing_is_covered():
    assert of({}, None, "case1_rmpc") == ["no certificate: controller robust_mpc has no tube"]


def test_the_status_tells_of_declared_hardware_alone():
    """In step 0 the error is inside the set in every flight, and the controller does not know of a fault."""
    lock = [{"channel": "elevator_deflection", "type": "lock_in_place", "start": "0 s"}]
    for changes, status in (
        ({"fault": lock}, TubeStatusCode.OK),
        ({"turbulence.sigma_up": "1 ft/s"}, TubeStatusCode.UNCERTIFIED_HARDWARE),
        ({"turbulence.sigma_up": "1 ft/s", "vehicle.coupling": "derived"}, TubeStatusCode.UNCERTIFIED_VEHICLE),
    ):
        parts = assemble_flight(load_scenario("case1", changes))
        assert next(steps(parts)).diagnostics.status is status
        assert bool(uncovered_hardware({}, BASELINE)) is False

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hsv.design.hardware.declared import REACH, declared, declared_actuators, described, sensors
from hsv.design.hardware.plan import Plan
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario
from hsv.model.sensors import sensor_data
from hsv.model.signals import N_RIGID


@pytest.mark.long
def test_noise_counts_with_its_reach_and_bias_once(problem, subject):
    models, unbounded = described(
        subject, sensor_set="fine", bias=["pitch_angle = -0.1 deg"], turbulence="2 ft/s", density="1 %"
    )
    assert not unbounded
    unexplained = models.pop("model errors under sensors")(problem.system)
    assert unexplained.half_width.size == 0 and unexplained.widening.min() >= 0.0 < unexplained.widening[6]
    assert list(models) == [
        "fine sensors: noise",
        "bias of pitch_angle = -0.1 deg",
        "turbulence 2 ft/s",
        "density 1 %",
    ]
    noise, bias, turbulence, density = (model(problem.system).half_width for model in models.values())
    assert noise[0] == pytest.approx(REACH * 0.3048)
    assert_allclose(bias, [0.0, 0.0, 0.0, np.radians(0.1), 0.0])
    assert_allclose(turbulence, [REACH * 0.6096, REACH * 0.6096, 0.0])
    assert_allclose(density, [0.0, 0.0, 0.01])


def test_an_inertial_angle_of_attack_has_the_error_of_the_pitch_angle(problem, subject):
    """Equal errors of both angles are one of the path angle less: the feedback on one takes from that on the other."""
    noise = sensors(sensor_data({"sensors.set": "inertial"}, subject.design.period), Plan.of(subject))["sensor noise"]
    seen, F = noise(problem.system).feedthrough, problem.system.F
    assert_allclose(seen[:, 3], F[:, 3] + F[:, 2])
    assert abs(seen[1, 3]) < 0.2 * abs(F[1, 3])


def test_less_than_the_largest_noise_is_passed_now_and_then(subject, plan):
    scenario = load_scenario("case1", {"sensors.set": "fine", "seed": 3})
    history = fly(assemble_flight(scenario, subject.design)).history
    bound = sensors(sensor_data(scenario.parameters(), subject.design.period), plan)["sensor noise"].error
    beyond = np.abs(history.estimate - history.state)[:, :N_RIGID] > bound
    assert 0.5 / 370 < beyond.mean() < 2.0 / 370


def test_what_has_no_bound_is_said(subject):
    scenario = load_scenario("case1", {"sensors.altitude.drop_out": "1 %", "estimator.enabled": True})
    assert declared(subject, scenario) == ({}, ["drop-out of a sensor", "estimator"])


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"link.measurement.delay": 1}, "link of the measurement"),
        ({"link.command.loss": "1 %"}, "link of the command"),
        ({"link.computational_delay": "5 ms"}, "link of the command"),
        (
            {"actuator.elevator_deflection": {"set": "elevator_50", "natural_frequency": "5 rad/s"}},
            "actuator.elevator_deflection.natural_frequency",
        ),
    ],
)
def test_links_and_actuators_of_ones_own_have_no_bound(subject, change, named):
    assert declared(subject, load_scenario("case1", change)) == ({}, [named])


def test_a_scenario_without_actuators_flies_ideal_ones():
    assert declared_actuators(load_scenario("case1")) == "ideal"
    assert declared_actuators(load_scenario("case1_realistic")) == "fuel_10,elevator_50"


def test_air_of_a_scenario_counts_with_its_reach(problem, subject):
    changes = {
        "wind": {"up": "-3 ft/s"},
        "turbulence": {"sigma_up": "1 ft/s"},
        "gust": {"starts": ["10 s", "20 s"], "up": ["5 ft/s", "-2 ft/s"], "lengths": ["700 ft", "700 ft"]},
        "density": {"offset": "-2 %", "sigma": "1 %"},
    }
    models, _ = declared(subject, load_scenario("case1", changes))
    found = {name: model(problem.system).half_width.tolist() for name, model in models.items()}
    assert found["wind"] == pytest.approx([0.0, 3 * 0.3048, 0.0])
    assert found["gusts"] == pytest.approx([0.0, 7 * 0.3048, 0.0])
    assert found["turbulence"] == pytest.approx([0.0, REACH * 0.3048, 0.0])
    assert found["density"] == pytest.approx([0.0, 0.0, 0.05])


def test_the_reach_that_is_written_as_the_bound_of_all_noise_is_taken(subject):
    assert "turbulence 2 ft/s" in described(subject, turbulence="2 ft/s", reach=8.572)[0]

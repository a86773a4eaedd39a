"""Flights with imperfect hardware, along ramps and governed commands, and with other control laws."""

import numpy as np
import pytest
from flights import components
from marking import long
from real_hardware import HARDWARE, RANDOM, SHORT

from hsv.base.errors import ScenarioError
from hsv.certificate.coverage import region_parameters
from hsv.control.design import ControlDesign
from hsv.design.inputs import find_inputs, read_inputs
from hsv.flight.assembly import assemble, assemble_flight, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.governed import governed
from hsv.flight.scenario import load_scenario
from hsv.model.plant import FlightStatus


def parts(name, **changes):
    return assemble_flight(load_scenario("case1", SHORT | HARDWARE[name] | changes))


@pytest.mark.parametrize("name", [name if "everything" in name or name == "air" else long(name) for name in HARDWARE])
def test_the_seed_decides_all_that_is_random_and_nothing_else(name):
    first = fly(parts(name)).fingerprint
    assert fly(parts(name)).fingerprint == first
    assert (fly(parts(name, seed=8)).fingerprint != first) == (name in RANDOM)


def flown_with(link, **changes):
    return fly(assemble_flight(load_scenario("case1", SHORT | {"link": link} | changes)))


def test_computing_for_whole_periods_is_a_delay_of_the_command_to_the_bit():
    computing, trim = flown_with({"computational_delay": "60 ms"}), parts("air").plant.initial.input
    assert computing.fingerprint == flown_with({"command": {"delay": 3}}).fingerprint
    assert computing.fingerprint == flown_with({"computational_delay": "20 ms", "command": {"delay": 2}}).fingerprint
    history = computing.history
    assert np.array_equal(history.actuator[:3], np.tile(trim, (3, 1)))
    assert np.array_equal(history.actuator[3:], history.command[:-3])


def test_an_estimator_makes_the_hard_sensors_flyable():
    def elevator_rms(**changes):
        flight = fly(assemble_flight(load_scenario("case1", {"sensors": {"set": "ghv"}, "seed": 1} | changes)))
        assert flight.status is FlightStatus.FINISHED
        before_fault = (flight.time >= 60.0) & (flight.time < 95.0)
        return np.degrees(flight.history.actuator[before_fault, 1].std())

    # The measured values are 5.16 deg and 0.32 deg.
    assert elevator_rms() > 4.0
    assert elevator_rms(estimator={"enabled": True}) < 1.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"enabled": 1}, r"estimator.enabled = 1: expected bool"),
        ({"enabled": True}, r"estimator.enabled = true: no noise of altitude, .* or sensors with noise, such as"),
    ],
)
def test_a_malformed_estimator_is_refused(table, message):
    with pytest.raises(ScenarioError, match=message):
        assemble_flight(load_scenario("case1", {"estimator": table}))


def test_a_ramp_that_ends_after_the_flight_is_flown_up_to_the_flights_end():
    whole, short = (load_scenario("case2_baseline", {"fault": [], "duration": f"{t} s"}) for t in (100, 40))
    assert short.command[0].end > short.duration
    states = [fly(assemble_flight(scenario)).history.state for scenario in (whole, short)]
    assert np.array_equal(states[0][: len(states[1])], states[1])


def test_without_fault_coupling_and_filter_the_tube_has_nothing_to_do():
    ideal = {"vehicle__model": "DM", "notch__enabled": False, "fault__channels": ["none"]}
    flight = fly(components("case2_baseline", duration=100.0, **ideal))
    error = np.abs(flight.history.state - flight.reference - flight.history.deviation).max(axis=0)
    # Only linearisation errors remain while x_n is not zero. The step itself is 600 ft and 250 ft/s.
    assert error[0] < 0.5 and error[1] < 0.1


def test_robust_mpc_is_the_tube_law_about_a_nominal_trajectory_under_its_own_gain():
    values = {**flight_parameters(load_scenario("case1_rmpc_fourth_k")), "duration": 4.0, "fault.starts": [1.0]}
    design = ControlDesign.from_parameters(values)
    gain = design.nominal_gains[values["robust_mpc.gain_index"]].ravel().tolist()
    # In K (x - x_r - x_n) + K x_n + u_r the nominal state cancels. The invariant set belongs to another loop.
    as_tube_law = {name: value for name, value in values.items() if not name.startswith("tube.")}
    as_tube_law |= {"controller": "tube_mpc", "feedback.gain": gain, "nominal.gains": gain}
    as_tube_law["nominal.ellipsoids"] = design.nominal_ellipsoids[0].ravel().tolist()
    robust, tube = fly(assemble(values)).history, fly(assemble(as_tube_law)).history
    np.testing.assert_allclose(tube.state, robust.state, rtol=1e-11, atol=1e-11)


def test_the_governor_takes_case_1_as_it_made_it_and_its_design_measures_along_that_reference():
    scenario = load_scenario("case1_governed")
    again = governed("case1_governed", scenario.settings["reference.blend"]).reference
    times = scenario.commands.times
    assert again.corners[-1].time - again.corners[-2].time == pytest.approx(times[-1] - times[-2])
    inputs = read_inputs(find_inputs("governed"))
    declared, flown = region_parameters(inputs.model_dump(), inputs.flown_vehicle), scenario.parameters()
    names = [name for name in declared if name.startswith("reference.")]
    assert "reference.blend" in names
    assert all(declared[name] == pytest.approx(flown[name], rel=1e-12) for name in names)

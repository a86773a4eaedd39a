"""Changes in flight from outside: refused or accepted, stamped with their step, recorded, and replayed bit for bit."""

import dataclasses
import json
import signal

import numpy as np
import pytest
from hsv_msgs.msg import Reference
from node_processes import fly_until, last_line, recorded_steps, short_scenario
from real_hardware import ELEVATOR, scenario_file
from waiting import output_of

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import flown_parameters
from hsv.control.design_file import find_design, read_design, write_design
from hsv.control.reference_trajectory import COLUMNS

pytestmark = [pytest.mark.graph, pytest.mark.long]

PERIOD = 0.02


def start(processes, scenario, pace):
    """Start a flight long enough that no change comes too late; return its process and its bag."""
    bag = processes.folder / "flown"
    flight = processes.start("hsv", "run", scenario, "--bag", bag, "--real-time-factor", pace, "--no-report")
    fly_until(flight, bag, 50)
    return flight, bag


def refused(processes, *words, said):
    done = processes.run("hsv", *words)
    assert done.returncode == 2 and said in last_line(done), done.stdout


def answered(processes, *words):
    done = processes.run("hsv", *words, "--json")
    assert done.returncode == 0, done.stdout
    return json.loads(last_line(done))


def interrupt(flight):
    flight.send_signal(signal.SIGINT)
    output = output_of(flight)
    assert flight.returncode == 130, output


def assert_repeated(processes, path):
    """Assert that replays of all nodes and of the graph equal the bag."""
    for words in ((), ("--rerun",)):
        done = processes.run("hsv", "replay", path, *words)
        assert done.stdout.count("identical in every byte") == 5, done.stdout


def test_faults_with_parameters_are_injected_and_repeated(processes):
    flight, path = start(processes, scenario_file(processes.folder, "everything estimated", duration="3600 s"), "4.0")
    oscillation = ("oscillation", "amplitude=0.3 deg", "frequency=0.7 Hz", "random_on=0.4 s", "random_off=0.2 s")
    steps = [
        answered(processes, "fault", "inject", *fault, "--duration", "5 s")["step"]
        for fault in ((ELEVATOR, *oscillation), ("pitch_rate", "sensor_bias", "0.01 deg/s"))
    ]
    fly_until(flight, path, steps[0] + 400)
    interrupt(flight)
    assert_repeated(processes, path)


def test_tau_is_changed_recorded_and_repeated(processes):
    folder = processes.folder
    design = dataclasses.replace(
        read_design(find_design("baseline")), name="mine", tau_minimum=np.array([0.5, 0.5, 0.75, 0.75, 1.0])
    )
    write_design(folder / "mine.yaml", design, "")
    scenario = short_scenario(folder, duration=3600, fault=6)
    scheduled = [0.9, 0.9, 0.95, 0.95, 1.0]
    text = f'{scenario.read_text()}[[tube.change]]\nstart = "2 s"\ntau = {scheduled}\n'
    scenario.write_text(f'design = "{folder / "mine.yaml"}"\n{text}')
    flight, path = start(processes, scenario, "4.0")
    said = "feedback.tau[0] = 0.4: expected 0.5 to 1, the certified range"
    refused(processes, "set", "tau", "0.4, 0.4, 0.7, 0.7, 1", said=said)
    fly_until(flight, path, 150)
    answer = answered(processes, "set", "feedback.tau", "[80 %, 0.8, 0.9, 0.9, 1]")
    fly_until(flight, path, recorded_steps(path) + 550)
    interrupt(flight)
    bag, step, changed = Bag(path), answer["step"], [0.8, 0.8, 0.9, 0.9, 1.0]
    assert answer["value"] == changed and answer["time_s"] == pytest.approx(step * PERIOD)
    [said] = [log.msg for _, log in bag.decode("/rosout") if "from step" in log.msg]
    assert said == f"feedback.tau = {changed} from step {step} on"
    flown = [list(status.tau) for _, status in bag.decode("/hsv/tube_status")]
    assert flown[:step] == [[1.0]] * 100 + [scheduled] * (step - 100)
    assert flown[step:] == [changed] * (len(flown) - step) and 100 < step < len(flown)
    values = flown_parameters(bag)
    # Other nodes keep their parameters, as their design need not be certified for the controller's new tau.
    assert values.of("nominal_trajectory")["tau_change.starts"] == [2.0]
    assert values.of("tube_mpc")["tau_change.starts"] == pytest.approx([2.0, step * PERIOD])
    assert_repeated(processes, path)


def test_points_are_commanded_recorded_and_repeated(processes):
    flight, path = start(processes, short_scenario(processes.folder, duration=3600, fault=6), "2.0")
    # While the flight is paused, the second command certainly comes before the first takes effect.
    answered(processes, "set", "paused", "true")
    refused(processes, "command", "200000 ft", "8000 ft/s", said="altitude = 60960 m: expected")
    said = "no reference to 26000 m and 2400 m/s fits"
    refused(processes, "command", "85302 ft", "7874 ft/s", "--blend", "0.02 s", said=said)
    points = (("86000 ft", "8120 ft/s"), ("86100 ft", "8150 ft/s"))
    taken = [answered(processes, "command", *point, "--blend", "1.5 s") for point in points]
    answered(processes, "set", "real_time_factor", "0")
    answered(processes, "set", "paused", "false")
    fly_until(flight, path, taken[1]["step"] + 150)
    interrupt(flight)

    bag = Bag(path)
    published = [message for _, message in bag.decode("/hsv/reference")]
    first, second = (answer["step"] for answer in taken)
    flown, planning, rejected = Reference.FLOWN, Reference.PLANNING, Reference.REJECTED
    assert [message.status for message in published] == [flown, planning, rejected, *[planning, flown] * 2]
    assert [message.step for message in published] == [0, first, first, first, first, second, second]
    corners = [np.array([getattr(message, name) for name in COLUMNS]).T for message in published]
    planned, once, twice = (corners[row] for row in (0, 4, 6))
    for row, unchanged in ((1, planned), (2, planned), (3, planned), (5, once)):
        assert np.array_equal(corners[row], unchanged)
    assert np.array_equal(once[: len(planned)], planned) and np.array_equal(twice[: len(once)], once)
    assert np.array_equal(twice[-1, 1:], [26243.28, 2484.12, 1.5])
    assert [answer["end_s"] for answer in taken] == pytest.approx([once[-1, 0] + 1.5, twice[-1, 0] + 1.5])
    # The second reference begins to turn where the first has its last corner.
    assert second * PERIOD == pytest.approx(once[-1, 0] + PERIOD - 1.5)
    altitude = bag.columns("/hsv/nominal")["reference.altitude"]
    assert np.flatnonzero(np.diff(altitude))[0] == first
    assert flown_parameters(bag).of("nominal_trajectory")["reference.times"] == twice[:, 0].tolist()
    assert_repeated(processes, path)

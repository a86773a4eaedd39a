"""A graph of processes has the same bits as a flight of the library in one process, and a bag can repeat it."""

import json
import re

import numpy as np
import pytest
from node_processes import short_scenario
from real_hardware import SHORT, scenario_file
from waiting import exit_code_of, wait_until

from hsv.bags.description import TOPICS
from hsv.bags.flight import flight_fingerprint, input_columns, state_columns
from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.control.tube_law import TubeStatusCode
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario, scenario_text

pytestmark = pytest.mark.graph


def shortened(folder, name, duration, fault, effectiveness=0.9):
    """Write a shipped scenario, shortened and without limits, and return its path."""
    text = scenario_text(name).replace('"200 s"', f'"{duration} s"').replace('"100 s"', f'"{fault} s"')
    text = re.sub(r"\[limits\]\n([^\[\n].*\n|\n)*", "", text).replace("ess = 0.9", f"ess = {effectiveness}")
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def short_case2(folder):
    """Write Case 2 with a duration of 5 s: a twentieth of its ramp, with tau back at 1 in between."""
    path = folder / "ramp.toml"
    path.write_text(
        'extends = "case2"\nduration = "5 s"\n'
        '[[command]]\naltitude_change = "30 ft"\nvelocity_change = "12.5 ft/s"\nstart = "1 s"\nend = "4 s"\n'
        '[[fault]]\nchannel = "elevator_deflection"\ntype = "loss_of_effectiveness"\n'
        'effectiveness = 0.9\nstart = "3 s"\n'
        '[[tube.change]]\nstart = "2 s"\ntau = 1.0\n'
    )
    return path


def in_process(scenario):
    return fly(assemble_flight(load_scenario(str(scenario))))


@pytest.fixture(scope="module")
def case1(shared_processes):
    """Return the bag of Case 1, shortened to 5 s."""
    return shared_processes.fly(short_scenario(shared_processes.folder), "case1")


def test_graph_equals_in_process_bit_for_bit(case1, tmp_path):
    flight = in_process(short_scenario(tmp_path))
    nominal = case1.columns("/hsv/nominal")
    recorded = {
        "state": state_columns(case1.columns("/hsv/state")),
        "filtered_pitch_rate": case1.columns("/hsv/filtered_state")["filtered_pitch_rate"],
        "deviation": state_columns(nominal, "deviation."),
        "nominal_input": input_columns(nominal, "input."),
        "gain_index": nominal["gain_index"],
        "u_unsaturated": input_columns(case1.columns("/hsv/tube_status"), "u_unsaturated."),
        "command": input_columns(case1.columns("/hsv/command")),
        "actuator": input_columns(case1.columns("/hsv/actuator")),
    }
    assert np.array_equal(state_columns(nominal, "reference."), flight.reference)
    for name, column in recorded.items():
        assert np.array_equal(column, getattr(flight.history, name)), name
    assert all(len(case1.messages(topic)) == 251 for topic in TOPICS)


def test_composed_and_started_paused_equals_separate_processes_in_every_byte(shared_processes, case1):
    path = shared_processes.folder / "composed"
    words = (short_scenario(shared_processes.folder), "--composed", "--paused", "--no-report", "--bag", path)
    run = shared_processes.start("hsv", "run", *words)
    wait_until(lambda: (path / "composed_0.mcap").exists() or run.poll() is not None, [run.pid])
    released = shared_processes.run("hsv", "set", "paused", "false")
    assert "from step 0 on" in released.stdout, released.stdout
    assert exit_code_of(run) == 0
    compared = shared_processes.run("hsv", "diff", case1.path, path)
    assert compared.returncode == 0, compared.stdout
    # The output has no "except the padding": even padding bytes are equal.
    assert f"{251 * len(TOPICS)} messages: identical\n" in compared.stdout


@pytest.mark.long
@pytest.mark.parametrize("words", [(), ("--composed",)], ids=["apart", "composed"])
@pytest.mark.parametrize(
    "make",
    [
        short_case2,
        lambda folder: shortened(folder, "case1_rmpc", 3, 2),
        lambda folder: shortened(folder, "case1_kothare_online", 2.4, 2.2),
        lambda folder: scenario_file(folder, "everything"),
    ],
    ids=["case2", "robust_mpc", "LMI in flight", "real hardware"],
)
def test_laws_and_hardware_fly_as_in_process(processes, make, words):
    scenario = make(processes.folder)
    bag = processes.fly(scenario, "flown", *words)
    assert flight_fingerprint(bag) == in_process(scenario).fingerprint


@pytest.mark.long
def test_an_estimated_flight_is_that_of_the_library_and_tells_its_equipment(processes):
    scenario = scenario_file(processes.folder, "everything estimated")
    bag = processes.fly(scenario, "flown")
    flight = in_process(scenario)
    assert flight_fingerprint(bag) == flight.fingerprint
    assert [run.seed for _, run in bag.decode("/hsv/run")] == [SHORT["seed"]]
    estimate = [message.estimate for _, message in bag.decode("/hsv/filtered_state")]
    assert np.array_equal(estimate, flight.history.estimate)
    forces = bag.columns("/hsv/forces")
    assert np.any(forces["wind_up"] != 0.0)
    assert np.any(forces["effector.elevator_deflection"] != bag.columns("/hsv/actuator")["elevator_deflection"])
    # A sensor fault counts from the step in which it acts, although an earlier message announces it.
    acting = {(row["channel"], row["type"]): (row["start_s"], row["end_s"]) for row in describe(bag)["faults"]}
    assert acting["velocity", "sensor_freeze"] == (2.0, 4.0) and acting["engine", "thrust_loss"] == (1.0, 4.0)


@pytest.mark.long
def test_the_node_that_estimates_the_elevator_says_what_it_found(processes):
    # Longer than 10 s, the shortest flight that hsv replay accepts.
    scenario = shortened(processes.folder, "case1", 11, 3, effectiveness=0.5)
    scenario.write_text(f"{scenario.read_text()}\n[effectiveness]\nenabled = true\n")
    bag = processes.fly(scenario, "flown")
    assert flight_fingerprint(bag) == in_process(scenario).fingerprint
    assert processes.run("hsv", "replay", bag.folder).returncode == 0
    said = [
        {pair.key: pair.value for pair in status.values}
        for _, message in bag.decode("diagnostics")
        for status in message.status
        if status.name.startswith("tube_mpc")
    ]
    assert said[0]["elevator"] == "HEALTHY" and said[-1]["elevator"] == "LOSS"
    assert float(said[-1]["effectiveness"]) == pytest.approx(0.5, abs=0.01)
    assert all(0.0 < float(values["step_time_p99_ms"]) < 1e3 for values in said)


@pytest.mark.long
def test_qp_flies_as_in_process_and_leaving_the_tube_is_told(processes):
    scenario = shortened(processes.folder, "case1_qp", 4, 2, effectiveness=0.6)
    bag = processes.fly(scenario, "left", "--composed")
    assert flight_fingerprint(bag) == in_process(scenario).fingerprint
    status = bag.columns("/hsv/tube_status")
    outside = status["status"] == TubeStatusCode.OUTSIDE
    assert np.array_equal(outside, status["level"] > 1.0) and np.array_equal(outside, ~status["inside"])
    first = int(np.argmax(outside))
    assert 100 < first < 200
    said = [message.msg for _, message in bag.decode("/rosout")]
    assert any(f"left the tube at {0.02 * first:.2f} s: " in text for text in said)
    described = json.loads(processes.run("hsv", "info", processes.folder / "left", "--json").stdout)
    assert described["tube"]["outside_steps"] == outside.sum()
    assert described["tube"]["excursions"][0]["start_s"] == pytest.approx(0.02 * first)
    assert described["step_times"]["nodes"].keys() == {"nominal_trajectory", "tube_mpc"}
    for times in described["step_times"]["nodes"].values():
        assert 0.0 < times["median_ms"] <= times["p99_ms"] <= times["max_ms"]


@pytest.mark.long
def test_a_vehicle_outside_the_certified_set_is_told(processes):
    scenario = short_scenario(processes.folder, duration=1, fault=0.5, coupling="derived")
    # Warnings of nodes are shown for any log format of the user.
    processes.environment["RCUTILS_CONSOLE_OUTPUT_FORMAT"] = "[{severity}]: {message}"
    path = processes.folder / "uncertified"
    ran = processes.run("hsv", "run", scenario, "--no-report", "--bag", path, "--composed")
    assert ran.returncode == 0 and "[tube_mpc]: outside certified vehicle set: " in ran.stdout, ran.stdout
    status = Bag(path).columns("/hsv/tube_status")
    assert set(status["status"]) == {TubeStatusCode.UNCERTIFIED_VEHICLE} and status["inside"].all()
    told = processes.run("hsv", "info", path).stdout
    assert "uncertified steps 51" in told and "vehicle.coupling: derived; the certificate is for paper_like" in told


@pytest.mark.long
def test_the_bag_takes_a_vehicle_in_a_file_along(processes):
    mine, scenario = processes.folder / "mine.toml", processes.folder / "flight.toml"
    mine.write_text('extends = "parker"\n[rigid_body]\nmass = { value = "4600 kg" }\n')
    scenario.write_text('extends = "case1"\nvehicle = "mine.toml"\nduration = "12 s"\nfault = []\n[limits]\n')
    bag = processes.fly(scenario, "bag", "--composed")
    alone = in_process(scenario).fingerprint
    mine.unlink()
    scenario.unlink()
    assert flight_fingerprint(bag) == alone
    for words in ((), ("--rerun",)):
        replayed = processes.run("hsv", "replay", bag.folder, *words)
        assert replayed.stdout.count("identical in every byte") == 5, replayed.stdout


@pytest.mark.long
def test_a_diverging_flight_ends_cleanly_and_says_so(processes):
    scenario = short_scenario(processes.folder, duration=30, fault=29, coupling="derived", notch=False)
    done = processes.run("hsv", "run", scenario, "--composed", "--no-report", "--bag", processes.folder / "lost")
    assert done.returncode == 1 and "flight diverged at t = 17.5" in done.stdout
    bag = Bag(processes.folder / "lost")
    assert bag.complete and bag.columns("/hsv/state")["status"][-1] == 2
    assert len({len(bag.messages(topic)) for topic in TOPICS}) == 1


@pytest.mark.long
def test_a_slow_pace_is_kept_and_not_taken_for_a_hang(processes):
    scenario = short_scenario(processes.folder, duration=0.1, fault=0.05)
    words = ("--composed", "--no-report", "--step-timeout", "0.5", "--real-time-factor", "0.01", "--json")
    done = processes.run("hsv", "run", scenario, *words)
    assert done.returncode == 0 and "is stuck" not in done.stdout, done.stdout
    # Only a lower bound: a busy machine may be slower than the pace, but never faster.
    assert json.loads(done.stdout[done.stdout.index("{") :])["wall_time_s"] >= 9.5

"""Flights of the graph with all that is not ideal at once: those of the library, and repeated, bit for bit."""

from __future__ import annotations

import json
import signal

import numpy as np
import pytest
from injected_fault import last_line
from node_processes import Processes, fly_until
from real_hardware import ELEVATOR, SHORT, scenario_file
from waiting import output_of

from hsv.bags.flight import input_columns, state_columns
from hsv.bags.info import describe
from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps, flown_parameters
from hsv.bags.replay.engine import replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.flight.assembly import assemble_flight
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

pytestmark = pytest.mark.graph


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "words"),
    [("everything", ()), ("everything estimated", ()), ("everything estimated", ("--composed",))],
)
def test_graph_equals_in_process_bit_for_bit(shared_processes: Processes, name: str, words: tuple[str, ...]) -> None:
    scenario = scenario_file(shared_processes.folder, name)
    path = shared_processes.folder / "".join((scenario.stem, *words))
    done = shared_processes.run("hsv", "run", scenario, "--no-report", "--bag", path, *words)
    assert done.returncode == 0, done.stdout
    bag, history = Bag(path), fly(assemble_flight(load_scenario(str(scenario)))).history
    assert [run.seed for _, run in bag.decode("/hsv/run")] == [SHORT["seed"]]
    filtered = [message for _, message in bag.decode("/hsv/filtered_state")]
    measured = state_columns(bag.columns("/hsv/measurement"), "state.")
    assert {len(message.estimate) for message in filtered} == {9 if "estimated" in name else 0}
    recorded = {
        "state": state_columns(bag.columns("/hsv/state")),
        "estimate": np.array([message.estimate for message in filtered]) if "estimated" in name else measured,
        "filtered_pitch_rate": np.array([message.filtered_pitch_rate for message in filtered]),
        "deviation": state_columns(bag.columns("/hsv/nominal"), "deviation."),
        "command": input_columns(bag.columns("/hsv/command")),
        "actuator": input_columns(bag.columns("/hsv/actuator")),
    }
    for column, values in recorded.items():
        assert np.array_equal(values, getattr(history, column)), column
    forces = bag.columns("/hsv/forces")
    assert np.any(forces["wind_up"] != 0.0)
    assert np.any(forces["effector.elevator_deflection"] != recorded["actuator"][:, 1])
    # Of a sensor, too, from the step in which it fails, though the message before it tells of that.
    acting = {
        (fault["channel"], fault["type"]): (fault["start_s"], fault["end_s"]) for fault in describe(bag)["faults"]
    }
    assert acting["velocity", "sensor_freeze"] == (2.0, 4.0) and acting["engine", "thrust_loss"] == (1.0, 4.0)


@pytest.mark.long
def test_a_fault_with_parameters_injected_in_flight_is_repeated(processes: Processes) -> None:
    scenario = scenario_file(processes.folder, "everything estimated", duration="3600 s")
    path = processes.folder / "injected"
    words = ["--bag", path, "--real-time-factor", "4.0", "--no-report"]
    flight = processes.start("hsv", "run", scenario, *words)

    fly_until(flight, path, 50)
    oscillation = ("oscillation", "amplitude=0.3 deg", "frequency=0.7 Hz", "random_on=0.4 s", "random_off=0.2 s")
    first = None
    for fault in ((ELEVATOR, *oscillation), ("pitch_rate", "sensor_bias", "0.01 deg/s")):
        answer = processes.run("hsv", "fault", "inject", *fault, "--duration", "5 s", "--json")
        assert answer.returncode == 0, answer.stdout
        first = first or json.loads(last_line(answer))["step"]
    fly_until(flight, path, first + 400)
    flight.send_signal(signal.SIGINT)
    output = output_of(flight)
    assert flight.returncode == 130, output

    bag = Bag(path)
    values = flown_parameters(bag)
    values.shared["duration"] = complete_steps(bag) * values.shared["period"]
    results = [replay(bag, process, values, lambda *_: None) for process in processes_of("tube_mpc", True).values()]
    results += rerun(bag, "tube_mpc", values, lambda *_: None)
    assert len(results) == 10
    assert [r.process.node.name for r in results if not r.identical] == []
    for node in ("notch_filter", "tube_mpc"):
        done = processes.run("hsv", "replay", path, "--over-dds", "--node", node)
        assert done.stdout.count("identical in every byte") == 1, done.stdout

"""Other controllers and nominal laws over DDS: the flights of the library, bit for bit, and what is said of them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from node_processes import Processes, short_scenario

from hsv.bags.flight import input_columns, state_columns
from hsv.bags.reader import Bag
from hsv.control.tube_law import TubeStatusCode
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.history import History
from hsv.flight.scenario import load_scenario, scenario_text

pytestmark = pytest.mark.graph


def _shortened(processes: Processes, scenario: str, duration: float, fault: float, value: float = 0.9) -> Path:
    text = scenario_text(scenario).replace('"200 s"', f'"{duration} s"').replace('"100 s"', f'"{fault} s"')
    path = processes.folder / f"{scenario}.toml"
    text = re.sub(r"\[limits\]\n([^\[\n].*\n|\n)*", "", text)  # wherever it stands in the file
    path.write_text(text.replace("effectiveness = 0.9", f"effectiveness = {value}"))
    return path


def _flown(processes: Processes, scenario: Path, name: str, *words: str) -> Bag:
    command = ("hsv", "run", scenario, "--no-report", "--bag", processes.folder / name, *words)
    done = processes.run(*command)
    assert done.returncode == 0, done.stdout
    return Bag(processes.folder / name)


def _check_equal(bag: Bag, history: History) -> None:
    nominal = bag.columns("/hsv/nominal")
    recorded = {
        "state": state_columns(bag.columns("/hsv/state")),
        "deviation": state_columns(nominal, "deviation."),
        "nominal_input": input_columns(nominal, "input."),
        "gain_index": nominal["gain_index"],
        "u_unsaturated": input_columns(bag.columns("/hsv/tube_status"), "u_unsaturated."),
        "actuator": input_columns(bag.columns("/hsv/actuator")),
    }
    for name, column in recorded.items():
        assert np.array_equal(column, getattr(history, name)), name


def _history(scenario: Path) -> History:
    return fly(assemble(flight_parameters(load_scenario(str(scenario))))).history


@pytest.mark.long
def test_robust_mpc_flies_as_in_process(processes: Processes) -> None:
    scenario = _shortened(processes, "case1_rmpc", 3, 2)
    bag = _flown(processes, scenario, "rmpc")
    _check_equal(bag, _history(scenario))
    status = bag.columns("/hsv/tube_status")
    assert set(status["status"]) == {TubeStatusCode.NO_SET} and np.isnan(status["level"]).all()


@pytest.mark.long
def test_qp_flies_as_in_process_and_leaving_the_tube_is_told(processes: Processes) -> None:
    scenario = _shortened(processes, "case1_qp", 4, 2, value=0.6)
    bag = _flown(processes, scenario, "left", "--composed")
    _check_equal(bag, _history(scenario))
    assert not bag.columns("/hsv/nominal")["status"].any()

    status = bag.columns("/hsv/tube_status")
    outside = status["status"] == TubeStatusCode.OUTSIDE
    assert np.array_equal(outside, status["level"] > 1.0) and np.array_equal(outside, ~status["inside"])
    first = int(np.argmax(outside))
    assert 100 < first < 200
    warned = [
        (message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec, {v.key: v.value for v in entry.values})
        for _, message in bag.decode("/diagnostics")
        for entry in message.status
        if entry.name == "tube_mpc: tube" and entry.level == 1
    ]
    assert warned[0][0] == pytest.approx(0.02 * first) and warned[0][1]["component"]
    said = [message.msg for _, message in bag.decode("/rosout")]
    assert any(f"left the tube at {0.02 * first:.2f} s: {warned[0][1]['component']}" in text for text in said)
    described = json.loads(processes.run("hsv", "info", processes.folder / "left", "--json").stdout)
    assert described["step_times"]["period_ms"] == 20.0
    assert described["step_times"]["nodes"].keys() == {"nominal_trajectory", "tube_mpc"}
    for times in described["step_times"]["nodes"].values():
        assert 0.0 < times["median_ms"] <= times["p99_ms"] <= times["max_ms"]
    told = described["tube"]
    assert told["outside_steps"] == outside.sum()
    assert told["excursions"][0]["start_s"] == pytest.approx(0.02 * first)


@pytest.mark.long
def test_the_lmi_in_flight_depends_on_the_flight_alone(processes: Processes) -> None:
    scenario = _shortened(processes, "case1_kothare_online", 2.4, 2.2)
    first, second = _flown(processes, scenario, "first"), _flown(processes, scenario, "second", "--composed")
    history = _history(scenario)
    _check_equal(first, history)
    _check_equal(second, history)
    indices = first.columns("/hsv/nominal")["gain_index"]
    assert np.all(indices[:100] < 255) and np.all(indices[100:] == 255)


@pytest.mark.long
def test_a_vehicle_outside_the_certified_set_is_told(processes: Processes) -> None:
    scenario = short_scenario(processes.folder, duration=1, fault=0.5, coupling="derived")
    # Warnings of nodes are shown whatever form of the log the user has chosen.
    processes.environment["RCUTILS_CONSOLE_OUTPUT_FORMAT"] = "[{severity}]: {message}"
    path = processes.folder / "uncertified"
    flown = processes.run("hsv", "run", scenario, "--no-report", "--bag", path, "--composed")
    assert flown.returncode == 0 and "[tube_mpc]: outside certified vehicle set: " in flown.stdout, flown.stdout
    bag = Bag(path)
    status = bag.columns("/hsv/tube_status")
    assert set(status["status"]) == {TubeStatusCode.UNCERTIFIED_VEHICLE} and status["inside"].all()
    told = processes.run("hsv", "info", path).stdout
    assert "vehicle that the design is not certified for" in " ".join(told.split())

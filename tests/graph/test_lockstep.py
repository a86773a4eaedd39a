"""A graph of shared_processes flies exactly what the library flies in one process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from marking import long
from node_processes import Processes, short_scenario
from waiting import exit_code_of, wait_until

from hsv.bags.description import TOPICS
from hsv.bags.flight import flight_data, input_columns, state_columns
from hsv.bags.reader import Bag
from hsv.flight.assembly import assemble, flight_parameters
from hsv.flight.closed_loop import fly
from hsv.flight.scenario import load_scenario

pytestmark = pytest.mark.graph


@pytest.fixture(scope="module")
def case1(shared_processes: Processes) -> Bag:
    """Case 1 in five seconds."""
    return _fly(shared_processes, short_scenario(shared_processes.folder), "case1")


@pytest.fixture(scope="module")
def case2(shared_processes: Processes) -> Bag:
    """Case 2 in five seconds."""
    return _fly(shared_processes, _short_case2(shared_processes.folder), "case2")


def _fly(shared_processes: Processes, scenario: Path, name: str, *words: str) -> Bag:
    done = shared_processes.run("hsv", "run", scenario, "--no-report", "--bag", shared_processes.folder / name, *words)
    assert done.returncode == 0, done.stdout
    return Bag(shared_processes.folder / name)


def _short_case2(folder: Path) -> Path:
    """Case 2 in five seconds, a twentieth of its ramp in a twentieth of its time, tau back to 1 in between."""
    path = folder / "ramp.toml"
    path.write_text(
        'extends = "case2"\nduration = "5 s"\n'
        '[[command]]\naltitude_change = "30 ft"\nvelocity_change = "12.5 ft/s"\nstart = "1 s"\nend = "4 s"\n'
        '[[fault]]\nchannel = "elevator_deflection"\ntype = "loss_of_effectiveness"\n'
        'effectiveness = 0.9\nstart = "3 s"\n'
        '[[tube.change]]\nstart = "2 s"\ntau = 1.0\n'
    )
    return path


@pytest.mark.parametrize(("flown", "shortened"), [("case1", short_scenario), long("case2", _short_case2)])
def test_graph_equals_in_process_bit_for_bit(
    request: pytest.FixtureRequest, tmp_path: Path, flown: str, shortened: Callable[[Path], Path]
) -> None:
    bag: Bag = request.getfixturevalue(flown)
    flight = fly(assemble(flight_parameters(load_scenario(str(shortened(tmp_path))))))
    history = flight.history
    nominal, filtered = bag.columns("/hsv/nominal"), bag.columns("/hsv/filtered_state")
    recorded = {
        "state": state_columns(bag.columns("/hsv/state")),
        "filtered_pitch_rate": filtered["filtered_pitch_rate"],
        "deviation": state_columns(nominal, "deviation."),
        "nominal_input": input_columns(nominal, "input."),
        "gain_index": nominal["gain_index"],
        "u_unsaturated": input_columns(bag.columns("/hsv/tube_status"), "u_unsaturated."),
        "command": input_columns(bag.columns("/hsv/command")),
        "actuator": input_columns(bag.columns("/hsv/actuator")),
    }
    assert np.array_equal(state_columns(nominal, "reference."), flight.reference)
    for name, column in recorded.items():
        assert np.array_equal(column, getattr(history, name)), name
    assert flight_data(bag).fault_start == 3.0
    assert len(history.state) == 251
    assert all(len(bag.messages(topic)) == 251 for topic in TOPICS)


def test_composed_and_started_paused_equals_separate_processes_in_every_byte(
    shared_processes: Processes, case1: Bag
) -> None:
    path = shared_processes.folder / "composed"
    words = (short_scenario(shared_processes.folder), "--composed", "--paused", "--no-report", "--bag", path)
    run = shared_processes.start("hsv", "run", *words)
    wait_until(lambda: (path / "composed_0.mcap").exists() or run.poll() is not None, [run.pid])
    released = shared_processes.run("hsv", "set", "paused", "false")
    assert "from step 1 on" in released.stdout, released.stdout
    assert exit_code_of(run) == 0
    compared = shared_processes.run("hsv", "diff", case1.path, path)
    assert compared.returncode == 0, compared.stdout
    # No "except the padding": of that, too, every byte is the same.
    assert f"{251 * len(TOPICS)} messages: identical\n" in compared.stdout


@pytest.mark.long
def test_a_diverging_flight_ends_cleanly_and_says_so(shared_processes: Processes) -> None:
    scenario = short_scenario(shared_processes.folder, duration=30, fault=29, coupling="derived", notch=False)
    words = ["--composed", "--no-report", "--bag", shared_processes.folder / "lost"]
    done = shared_processes.run("hsv", "run", scenario, *words)
    assert done.returncode == 1
    assert "flight diverged at t = 17.5" in done.stdout
    bag = Bag(shared_processes.folder / "lost")
    assert bag.complete
    assert bag.columns("/hsv/state")["status"][-1] == 2
    assert len({len(bag.messages(topic)) for topic in TOPICS}) == 1


@pytest.mark.long
def test_a_slow_pace_is_not_taken_for_a_hang(shared_processes: Processes) -> None:
    scenario = short_scenario(shared_processes.folder, duration=0.1, fault=0.05)
    words = ("--composed", "--no-report", "--step-timeout", "0.5", "--real-time-factor", "0.01")
    done = shared_processes.run("hsv", "run", scenario, *words)
    assert "is stuck" not in done.stdout, done.stdout
    assert done.returncode == 0, done.stdout


@pytest.mark.long
def test_pacing_keeps_to_the_wall_clock(shared_processes: Processes) -> None:
    import json

    scenario = short_scenario(shared_processes.folder, duration=2, fault=1)
    done = shared_processes.run(
        "hsv", "run", scenario, "--composed", "--no-report", "--real-time-factor", "1", "--json"
    )
    assert done.returncode == 0, done.stdout
    # A lower bound only: a loaded machine may be late, but never early.
    assert json.loads(done.stdout[done.stdout.index("{") :])["wall_time_s"] >= 1.9

"""The adjustable factor changed in flight, from outside: refused, taken, stamped with its step, recorded, repeated."""

from __future__ import annotations

import dataclasses
import json
import signal
from pathlib import Path

import numpy as np
import pytest
from injected_fault import last_line
from node_processes import Processes, fly_until, recorded_steps, short_scenario
from waiting import output_of

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps, flown_parameters
from hsv.bags.replay.engine import replay, rerun
from hsv.bags.replay.processes import processes_of
from hsv.control.design import find_design, read_design, write_design

pytestmark = pytest.mark.graph


def scenario(folder: Path) -> Path:
    """Case 1 with the baseline's gain, said to be certified from 0.5 on; changed at 2 s by schedule."""
    design = dataclasses.replace(
        read_design(find_design("baseline")), name="mine", tau_minimum=np.array([0.5, 0.5, 0.75, 0.75, 1.0])
    )
    write_design(folder / "mine.yaml", design, "")
    path = short_scenario(folder, duration=3600, fault=6)
    text = path.read_text() + '[[tube.change]]\nstart = "2 s"\ntau = [0.9, 0.9, 0.95, 0.95, 1.0]\n'
    path.write_text(f'design = "{folder / "mine.yaml"}"\n{text}')
    return path


@pytest.mark.long
def test_tau_is_changed_recorded_and_repeated(processes: Processes, tmp_path: Path) -> None:
    bag_path = tmp_path / "flown"
    # No change comes too late for this flight; it is interrupted once there is enough of it for a replay.
    words = ["--bag", bag_path, "--real-time-factor", "4.0", "--no-report"]
    flight = processes.start("hsv", "run", scenario(tmp_path), *words)
    fly_until(flight, bag_path, 50)
    refused = processes.run("hsv", "set", "tau", "0.4, 0.4, 0.7, 0.7, 1")
    assert refused.returncode == 2
    assert "feedback.tau[0] = 0.4: expected 0.5 to 1, the certified range" in refused.stdout
    fly_until(flight, bag_path, 150)
    taken = processes.run("hsv", "set", "feedback.tau", "[80 %, 0.8, 0.9, 0.9, 1]", "--json")
    assert taken.returncode == 0, taken.stdout
    answer = json.loads(last_line(taken))
    assert answer["value"] == [0.8, 0.8, 0.9, 0.9, 1.0]
    fly_until(flight, bag_path, recorded_steps(bag_path) + 550)
    flight.send_signal(signal.SIGINT)
    output = output_of(flight)
    assert flight.returncode == 130, output

    bag = Bag(bag_path)
    [said] = [log.msg for _, log in bag.decode("/rosout") if "from step" in log.msg]
    step = answer["step"]
    assert said == f"feedback.tau = [0.8, 0.8, 0.9, 0.9, 1.0] from step {step} on"
    assert answer["time_s"] == pytest.approx(step * 0.02)
    flown = [list(status.tau) for _, status in bag.decode("/hsv/tube_status")]
    assert flown[:step] == [[1.0]] * 100 + [[0.9, 0.9, 0.95, 0.95, 1.0]] * (step - 100)
    assert flown[step:] == [[0.8, 0.8, 0.9, 0.9, 1.0]] * (len(flown) - step) and 100 < step < len(flown)
    events = [event for _, event in bag.decode("/parameter_events") if event.node == "/tube_mpc"]
    changed = [list(p.value.double_array_value) for event in events for p in event.changed_parameters]
    assert changed == [[0.8, 0.8, 0.9, 0.9, 1.0]]

    values = flown_parameters(bag)
    # Other nodes keep what they had: their design need not be certified for what the controller flew with.
    assert values.of("nominal_trajectory")["tau_change.starts"] == [2.0]
    assert values.of("tube_mpc")["tau_change.starts"] == pytest.approx([2.0, step * 0.02])
    results = [replay(bag, processes_of("tube_mpc")["tube_mpc"], values, lambda *_: None)]
    # The graph repeats scheduled changes as the loop in process does: tests/graph/test_lockstep.py.
    values.shared["duration"] = complete_steps(bag) * values.shared["period"]
    results += rerun(bag, "tube_mpc", values, lambda *_: None)
    assert all(result.identical for result in results)
    done = processes.run("hsv", "replay", bag_path, "--over-dds", "--node", "tube_mpc")
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("identical in every byte") == 1, done.stdout

"""A message that no block can accept ends the run; the error names topic and field, and no step uses it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from marking import long
from node_processes import short_scenario

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps

pytestmark = pytest.mark.graph

DISTURBER = Path(__file__).parents[1] / "support" / "wrong_message.py"
FROM_STEP = 100

APART: tuple[str, ...] = ()
COMPOSED = ("--composed",)


@pytest.mark.parametrize(
    ("how", "words", "node", "said"),
    [
        ("fault", COMPOSED, "plant", "/hsv/actuator: active[0]: fault.type = 'stuk': expected one of "),
        long("value", APART, "plant", "/hsv/actuator: active[0]: fault.parameter_values: 0 values, expected 1, one"),
        long("estimate", APART, "tube_mpc", "/hsv/filtered_state: estimate: 1 numbers, expected 9, or none"),
        long("states", APART, "tube_mpc", "/hsv/filtered_state: filter_state: 4 numbers, expected 2 of the notch filt"),
        long("gain", COMPOSED, "tube_mpc", "/hsv/nominal: gain: 9 numbers, expected 18, or none"),
        long("command", APART, "fault_injector", "/hsv/command: hsv_msgs/msg/ControlInput: "),
        long("measurement", APART, "", "/hsv/measurement: hsv_msgs/msg/Measurement: "),
        long("measurement", COMPOSED, "", "/hsv/measurement: hsv_msgs/msg/Measurement: "),
    ],
)
def test_a_message_that_no_block_can_take_ends_the_run_by_topic_and_field(processes, how, words, node, said):
    bag = processes.folder / how
    disturber = processes.start(sys.executable, DISTURBER, how, str(FROM_STEP))
    # The flight is paced, so that the wrong message of a step comes before the right one.
    paced = ("--real-time-factor", "2", "--step-timeout", "30")
    run = ("hsv", "run", short_scenario(processes.folder, duration=100), "--no-report", "--bag", bag, *paced, *words)
    done = processes.run(*run)
    assert done.returncode == 1 and "Traceback" not in done.stdout, done.stdout
    fatal = [line for line in done.stdout.splitlines() if "[FATAL]" in line]
    # Two nodes subscribe to the measurement.
    assert fatal and all(f"{node}]: {said}" in line for line in fatal) and len(fatal) <= 2 - bool(node), done.stdout
    assert disturber.poll() is None
    flown = Bag(bag)
    assert flown.complete and FROM_STEP <= complete_steps(flown) < 5000
    for time, step in re.findall(r"broken off (?:by the plant )?at t = ([\d.]+) s, step (\d+)", done.stdout):
        assert float(time) == pytest.approx(0.02 * int(step))

"""A fault of the fuel injected in flight and cleared again by command, and what the bag must then show."""

from __future__ import annotations

import json
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest
from node_processes import Processes, recorded_steps
from waiting import exit_code_of, wait_until

from hsv.bags.reader import Bag
from hsv.bags.replay.attached import complete_steps

LONG = ["-p", "duration:=600.0", "-p", "real_time_factor:=2.0"]
"""Parameters of a flight that does not end before the commands, however slow the machine: it is interrupted."""


FUEL = "fuel_equivalence_ratio"


def last_line(done: subprocess.CompletedProcess[str]) -> str:
    """Return the last line that a command has printed; those before tell for whom it waited.

    Or that Fast DDS takes another port of its shared memory: the names of these are the same in all domains of a
    machine, and another process may hold one just then.
    """
    *before, last = done.stdout.splitlines()
    others = [line for line in before if "Failed init_port fastrtps_port" not in line]
    assert all(line.startswith("waiting for ") for line in others), done.stdout
    return str(last)


def _asked(processes: Processes, *words: str) -> dict[str, Any]:
    done = processes.run("hsv", "fault", *words, "--json")
    assert done.returncode == 0, done.stdout
    return dict(json.loads(last_line(done)))


def inject_and_land(processes: Processes, flying: subprocess.Popen[str], bag: Path) -> None:
    """Inject and clear a fault in the flight of ``flying``, interrupt it later, check what was recorded."""
    refused = processes.run("hsv", "fault", "inject", "rudder", "loss_of_effectiveness", "0.5")
    assert refused.returncode == 2 and "fault.channel = 'rudder': expected one of" in last_line(refused)
    refused = processes.run("hsv", "fault", "inject", FUEL, "loss_of_effectiveness", "-0.5")
    assert refused.returncode == 2 and "fault.effectiveness = '-0.5': expected from 0 to 1" in last_line(refused)
    refused = processes.run("hsv", "fault", "inject", FUEL, "loss_of_effectiveness", "0.5", "--duration", "-1 s")
    assert refused.returncode == 2 and "duration = '-1 s': expected from 0 to" in last_line(refused)
    first = _asked(processes, "inject", FUEL, "loss_of_effectiveness", "95 %", "--duration", "900 s")["step"]
    wait_until(lambda: recorded_steps(bag) > first, [flying.pid], lambda: recorded_steps(bag))
    acting = _asked(processes, "list")
    assert acting["active"] == [
        {"channel": FUEL, "type": "loss_of_effectiveness", "parameters": {"effectiveness": 0.95}}
    ]
    assert first <= acting["step"] and acting["time_s"] == pytest.approx(acting["step"] * 0.02)
    end = _asked(processes, "clear", FUEL)["step"]
    wait_until(lambda: recorded_steps(bag) > end, [flying.pid], lambda: recorded_steps(bag))
    flying.send_signal(signal.SIGINT)
    assert exit_code_of(flying) == 0
    processes.stop()
    _assert_fault_acted(Bag(bag), first, end)


def _assert_fault_acted(bag: Bag, first: int, end: int) -> None:
    steps = complete_steps(bag)
    assert bag.complete and first < end < steps
    active = [message.step for _, message in bag.decode("/hsv/actuator") if message.active]
    assert active == list(range(first, end))
    actuator, command = (bag.columns(topic)["fuel_equivalence_ratio"] for topic in ("/hsv/actuator", "/hsv/command"))
    ratio = actuator[:steps] / command[:steps]
    assert ratio[active] == pytest.approx(0.95)
